"""Functional maps and the point-to-point maps that they give."""
