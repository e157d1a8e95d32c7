"""What the verbs do with the library, loaded when a verb takes the step: `--help` imports none of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
