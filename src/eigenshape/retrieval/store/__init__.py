"""The index on disk: one SQLite file, what it holds, and how that is changed."""
