"""The certified eigensolver."""
