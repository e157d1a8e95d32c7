"""eigenshape hears the shape of things.

A shape of any dimension gives a Laplacian, the Laplacian a certified spectrum, the spectrum heat, heat the features
that persist, and features an answer to the question which shapes are alike.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
