"""Simulated scans: the visible part of a shape, depth images, and the rasterizer behind them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
