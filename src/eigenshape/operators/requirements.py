"""Checks of operators for the functions that need them."""

from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian


def require_matrix(laplacian: Laplacian, name: str = "laplacian") -> None:
    """Raise an error if the matrices of an operator are not all of it.

    The correction of a kernel changes eigenvalues after they are computed, so an equation with the
    matrices would silently be that of the uncorrected operator.
    """
    if laplacian.kernel is not None and laplacian.kernel.corrected:
        raise InvalidParameterError(
            f"{name} must be given by its matrices alone; it has correct='log', which changes "
            "eigenvalues after they are computed. Build it with correct=None, or use its spectrum, "
            "es.solve_spectrum(laplacian, k)."
        )
