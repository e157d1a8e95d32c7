"""Certified spectra and operators in torch, with gradients: losses, layers, encodings, data sets.

Import it by name, `import eigenshape.torch`: the rest of the library does not need torch.
"""

import lazy_loader

from eigenshape._extras import import_extra

import_extra("torch", "'eigenshape[torch]'")
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
