"""Maps on a shape by its eigenmodes, as brain research uses them: fits, nulls, waves, parcels."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
