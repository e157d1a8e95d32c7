"""Shapes that bend: handles, rigs, and what they make of a region that is turned or moved."""
