"""The index on disk, and the workers that fill it."""
