"""Describe many files in worker processes, and add them to an index."""
