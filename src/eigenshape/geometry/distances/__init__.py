"""Distances: along a surface, to a surface, and faces that cross."""
