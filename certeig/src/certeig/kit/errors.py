"""The exception tree.

CerteigError
├── InvalidParameterError(ValueError)  an argument has a wrong type or is out of range
├── FileFormatError(ValueError)        a file does not follow its format
└── ConvergenceError(RuntimeError)     a solver stopped before its result was certified

A message states the rule, the fact with index and value, and the remedy if there is one.
"""


class CerteigError(Exception):
    """Base class of all errors that certeig, and packages built on it, raise on purpose.

    Examples
    --------
    >>> import certeig
    >>> try:
    ...     certeig.eigenpairs([[2.0]], k=1)
    ... except certeig.CerteigError as err:
    ...     print(err)
    W must be a square sparse matrix; it is a list of shape (1, 1). Pass scipy.sparse.csr_array(W).
    """


class InvalidParameterError(CerteigError, ValueError):
    """An argument has a wrong type or is out of range.

    Examples
    --------
    >>> import certeig
    >>> from scipy.sparse import eye_array
    >>> try:
    ...     certeig.eigenpairs(eye_array(4), k=5)
    ... except certeig.InvalidParameterError as err:
    ...     print(err)
    k must lie in 1..4; it is 5.
    """


class FileFormatError(CerteigError, ValueError):
    """A file does not follow its format, or its format is not supported.

    Examples
    --------
    >>> import tempfile
    >>> import certeig
    >>> with tempfile.NamedTemporaryFile(suffix=".npz") as file:
    ...     try:
    ...         certeig.Spectrum.load(file.name)
    ...     except certeig.FileFormatError:
    ...         print("no spectrum")
    no spectrum
    """


class ConvergenceError(CerteigError, RuntimeError):
    """A solver stopped before its result was certified.

    Examples
    --------
    >>> import certeig
    >>> issubclass(certeig.ConvergenceError, RuntimeError)
    True
    """
