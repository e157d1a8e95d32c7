"""The formats of brains and neurons, a module each."""
