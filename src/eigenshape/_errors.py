"""The exception tree.

EigenshapeError
├── InvalidShapeError(ValueError)      a mesh or point cloud is not valid for the operation
├── InvalidParameterError(ValueError)  an argument has a wrong type or is out of range
├── FileFormatError(ValueError)        a file does not follow its format
├── ConvergenceError(RuntimeError)     a solver stopped before its result was certified
├── StoreError(RuntimeError)           an index on disk cannot be opened, read or written
└── MissingExtraError(ImportError)     an optional package is needed and not installed

A message states the rule, the fact with index and value, and the remedy if there is one. The base
class and those that are not about shapes are classes of certeig, whose solver raises them, too.
"""

from certeig.kit.errors import CerteigError


class InvalidShapeError(CerteigError, ValueError):
    """A mesh or point cloud is not valid for the operation.

    See Also
    --------
    repair : Repair a shape.

    Examples
    --------
    >>> import eigenshape as es
    >>> try:
    ...     es.cotangent_laplacian(([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
    ... except es.InvalidShapeError:
    ...     print("not valid")
    not valid
    """


class StoreError(CerteigError, RuntimeError):
    """An index on disk cannot be opened, read or written.

    See Also
    --------
    ShapeIndex : An index of shapes on disk.

    Examples
    --------
    >>> import eigenshape as es
    >>> try:
    ...     es.ShapeIndex.open("no-such-folder")
    ... except es.StoreError:
    ...     print("no index")
    no index
    """


class MissingExtraError(CerteigError, ImportError):
    """An optional package is needed and not installed.

    The message names the package and the command that installs it.

    Examples
    --------
    >>> import eigenshape as es
    >>> issubclass(es.MissingExtraError, ImportError)
    True
    """


def try_auto(shape: str = "mesh") -> str:
    """Return the remedy for a fault that the repair "auto" fixes, as the end of a message."""
    return f'Try repair({shape}, ["auto"]), or --repair auto on the command line.'


# Nouns of reports whose plural is not formed with an s.
PLURALS = {"vertex": "vertices", "tetrahedron": "tetrahedra", "simplex": "simplices"}


def count_nouns(number: int, noun: str) -> str:
    """Return a number with its noun, which is in the plural if the number is not 1."""
    return f"{number} {noun if number == 1 else PLURALS.get(noun, noun + 's')}"
