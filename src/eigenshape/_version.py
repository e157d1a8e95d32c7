"""The version, as the installed package tells it."""

import importlib.metadata

__version__ = importlib.metadata.version("eigenshape")
