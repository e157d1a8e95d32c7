"""The exception tree.

EigenshapeError
├── InvalidShapeError(ValueError)      a mesh or point cloud is not valid for the operation
├── InvalidParameterError(ValueError)  an argument has a wrong type or is out of range
├── FileFormatError(ValueError)        a file does not follow its format
├── ConvergenceError(RuntimeError)     a solver stopped before its result was certified
├── StoreError(RuntimeError)           an index on disk cannot be opened, read or written
└── MissingExtraError(ImportError)     an optional package is needed and not installed

A message states the rule, the fact with index and value, and the remedy if there is one.
"""


class EigenshapeError(Exception):
    """Base class of all errors that eigenshape raises on purpose.

    Examples
    --------
    >>> import eigenshape as es
    >>> try:
    ...     es.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 7]])
    ... except es.EigenshapeError as err:
    ...     print(err)
    faces must index vertices 0..2; face 0 is [0, 1, 7].
    """


class InvalidShapeError(EigenshapeError, ValueError):
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


class InvalidParameterError(EigenshapeError, ValueError):
    """An argument has a wrong type or is out of range.

    Examples
    --------
    >>> import eigenshape as es
    >>> try:
    ...     es.icosphere(-1)
    ... except es.InvalidParameterError as err:
    ...     print(err)
    level must lie in 0..9; it is -1.
    """


class FileFormatError(EigenshapeError, ValueError):
    """A file does not follow its format, or its format is not supported.

    Examples
    --------
    >>> import tempfile
    >>> import eigenshape as es
    >>> with tempfile.NamedTemporaryFile(suffix=".off") as file:
    ...     try:
    ...         es.read_mesh(file.name)
    ...     except es.FileFormatError:
    ...         print("not a mesh")
    not a mesh
    """


class ConvergenceError(EigenshapeError, RuntimeError):
    """A solver stopped before its result was certified.

    Examples
    --------
    >>> import eigenshape as es
    >>> issubclass(es.ConvergenceError, RuntimeError)
    True
    """


class StoreError(EigenshapeError, RuntimeError):
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


class MissingExtraError(EigenshapeError, ImportError):
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
