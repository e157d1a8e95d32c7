"""Checks of operators for the functions that need them."""

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.laplacian import Laplacian


def require_matrix(laplacian: Laplacian, name: str = "laplacian") -> None:
    """Raise an error unless a value is an operator whose matrices are all of it.

    The correction of a kernel changes eigenvalues after they are computed, so an equation with the
    matrices would silently be that of the uncorrected operator.
    """
    require_type(laplacian, Laplacian, name)
    if laplacian.kernel is not None and laplacian.kernel.corrected:
        raise InvalidParameterError(
            f"{name} must be given by its matrices alone; it has correct='log', which changes "
            "eigenvalues after they are computed. Build it with correct=None, or use its spectrum, "
            "es.solve_spectrum(laplacian, k)."
        )
