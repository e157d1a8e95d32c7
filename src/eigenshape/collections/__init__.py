"""Collections of specimens: surfaces placed and bent onto each other, mean shapes, transferred landmarks."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
