"""Approximate eigenpairs without a factorization of the whole operator."""
