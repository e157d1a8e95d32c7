"""Landmarks, their files, and the statistics of shapes: Procrustes fits, modes, groups, growth, symmetry."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
