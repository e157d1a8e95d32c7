"""Stand-ins for classes of other libraries, for programs that are written against these."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
