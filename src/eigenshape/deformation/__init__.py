"""Shapes that bend: handles, rigs, and what they make of a region that is turned or moved."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
