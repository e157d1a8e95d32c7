"""Repairs of meshes and clouds, each by its name."""
