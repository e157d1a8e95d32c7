"""Brackets that contain the exact eigenvalues of a shape."""
