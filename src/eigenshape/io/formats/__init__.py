"""The formats of mesh files, a module each."""
