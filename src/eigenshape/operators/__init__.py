"""Discrete Laplace operators, all in the one form of `Laplacian`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
