"""Discrete Laplace operators, all in the one form of `Laplacian`."""
