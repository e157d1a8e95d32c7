"""One shape: how it is read, and what is computed of it in the background."""
