"""How stable a spectrum is: closeness of shapes, one-to-one correspondences, perturbation bounds (thesis ch. 3, 4)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
