"""Public names that eigenshape has from certeig, its eigensolver."""

from certeig.kit.errors import CerteigError as EigenshapeError
from certeig.kit.errors import ConvergenceError, FileFormatError, InvalidParameterError
from certeig.kit.threads import set_threads

__all__ = [
    "ConvergenceError",
    "EigenshapeError",
    "FileFormatError",
    "InvalidParameterError",
    "set_threads",
]
