"""Sparse symmetric matrices: an order of elimination, factors, solves."""
