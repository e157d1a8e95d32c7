"""Descriptors of the literature, for comparison: ShapeDNA, affinity spectra, light fields."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
