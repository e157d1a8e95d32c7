"""The exception tree.

EigenshapeError
├── InvalidShapeError(ValueError)      the shape itself cannot be worked on
├── InvalidParameterError(ValueError)  an argument is out of its range
├── FileFormatError(ValueError)        a file is not what it says it is
├── ConvergenceError(RuntimeError)     a solver stopped before its proof was complete
├── StoreError(RuntimeError)           an index on disk cannot be opened, read or written
└── MissingExtraError(ImportError)     an optional package is needed and not installed

A message is one sentence of rule, one of fact with index and value, one of remedy where there is one.
"""


class EigenshapeError(Exception):
    """Every error that eigenshape raises on purpose."""


class InvalidShapeError(EigenshapeError, ValueError):
    """The shape itself cannot be worked on."""


class InvalidParameterError(EigenshapeError, ValueError):
    """An argument is out of its range."""


class FileFormatError(EigenshapeError, ValueError):
    """A file is not what it says it is."""


class ConvergenceError(EigenshapeError, RuntimeError):
    """A solver stopped before its proof was complete."""


class StoreError(EigenshapeError, RuntimeError):
    """An index on disk cannot be opened, read or written."""


class MissingExtraError(EigenshapeError, ImportError):
    """An optional package is needed and not installed."""


def try_auto(shape: str = "mesh") -> str:
    """Return the last sentence of a message whose fault the repair "auto" mends."""
    return f'Try repair({shape}, ["auto"]), or --repair auto on the command line.'
