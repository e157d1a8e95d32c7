"""Operators that take a shape as weighted points, and those of points without triangles."""
