"""Functional maps: maps between shapes as small matrices that act on functions in low modes."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, freeze, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import point_functions
from eigenshape.spectral.spectrum import Spectrum

# Share of the constant function that the first mode may lack. The eigenvectors of the approximate
# solver lack some of it; with a fixed boundary or in an interval most of it is missing.
LOST = 1e-3


@record
class FunctionalMap(ReadOnly):
    """A map between shapes, given by its action on functions (Ovsjanikov and others 2012).

    Functions are represented by coefficients in φ_i √A, orthonormal in B/A with A the area of the
    shape, so that size drops out: the matrix between a shape and a scaled copy is the identity, and
    constant functions are preserved.

    Attributes
    ----------
    matrix : (k2, k1) float
        Maps coefficients in the k1 lowest modes of the source to coefficients in the k2 lowest
        modes of the target.
    source, target : Spectrum
        Of connected shapes without fixed boundary, from the lowest eigenvalue on.

    Raises
    ------
    InvalidParameterError
        If the matrix is not finite or has more rows or columns than there are modes, or a spectrum
        does not begin with one constant function.

    See Also
    --------
    functional_map : Compute a map from pairs of points, or from descriptors.

    Examples
    --------
    The identity of a shape:

    >>> import eigenshape as es
    >>> from numpy import eye
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 8)
    >>> mapping = es.spectral.FunctionalMap(eye(5), spectrum, spectrum)
    >>> es.spectral.point_map(mapping).shape
    (288,)

    Maps are composed as matrices are, the first one on the right:

    >>> (mapping @ mapping).matrix.shape
    (5, 5)
    """

    matrix: Float[np.ndarray, "k2 k1"]
    source: Spectrum
    target: Spectrum

    def __post_init__(self) -> None:
        require_one_constant(self.source, "source")
        require_one_constant(self.target, "target")
        most = len(self.target.eigenvalues), len(self.source.eigenvalues)
        if self.matrix.ndim != 2 or not all(
            1 <= k <= n for k, n in zip(self.matrix.shape, most, strict=True)
        ):
            raise InvalidParameterError(
                f"A functional map must have a row for each mode of the target and a column for each of the source, at "
                f"most {most}; its shape is {self.matrix.shape}."
            )
        bad = np.argwhere(~np.isfinite(self.matrix))
        if len(bad):
            raise InvalidParameterError(
                f"The matrix of a map must be finite; entry {bad[0].tolist()} is not."
            )
        vars(self).update(matrix=freeze(self.matrix))

    @one_blas_thread()
    def __matmul__(self, first: object) -> "FunctionalMap":
        """Return the map from the source of `first` to our target, in the modes that both maps have.

        Raises an InvalidParameterError if the target of `first` is not our source.
        """
        if not isinstance(first, FunctionalMap):
            return NotImplemented
        k = min(first.matrix.shape[0], self.matrix.shape[1])
        one, other = (spectrum.eigenvectors[:, :k] for spectrum in (first.target, self.source))
        if not np.array_equal(one, other):
            raise InvalidParameterError(
                f"The target of the map on the right must be the source of the one on the left; their modes differ, on "
                f"{len(one)} and {len(other)} points."
            )
        return FunctionalMap(self.matrix[:, :k] @ first.matrix[:k], first.source, self.target)


def require_one_constant(spectrum: Spectrum, name: str) -> None:
    """Raise an error unless the first mode of a spectrum is constant and the only one of eigenvalue 0.

    This refuses intervals of a spectrum, fixed boundaries, disconnected shapes, and fewer than two
    modes.
    """
    if len(spectrum.eigenvalues) < 2:
        raise InvalidParameterError(
            f"A map needs at least 2 modes of each shape; the {name} has 1. Solve for more."
        )
    if spectrum.n_zero_modes > 1:
        raise InvalidParameterError(
            f"Shapes to be mapped must be connected; the {name} has the eigenvalues {spectrum.eigenvalues[0]:.3g} and "
            f"{spectrum.eigenvalues[1]:.3g}, which count as 0, so it has several components. "
            'Use es.repair(mesh, ["largest_component"]).'
        )
    areas = spectrum.point_areas
    lost = 1 - (spectrum.eigenvectors[:, 0] @ areas) ** 2 / areas.sum()
    if lost > LOST:
        raise InvalidParameterError(
            f"The first mode of a shape to be mapped must be constant; that of the {name} holds "
            f"{100 * (1 - lost):.3g} % of the constant function. "
            f"Solve from the lowest eigenvalue on, with no boundary fixed."
        )


def modes_of_both(source: Spectrum, target: Spectrum, n_modes: Integer) -> int:
    """Return a number of modes that both shapes have.

    Raise InvalidParameterError if one has fewer, or its spectrum does not begin with one constant
    function.
    """
    for spectrum, name in ((source, "source"), (target, "target")):
        require_type(spectrum, Spectrum, name)
        require_one_constant(spectrum, name)
    return whole_number(
        n_modes, "n_modes", 2, min(len(source.eigenvalues), len(target.eigenvalues))
    )


def unit_modes(spectrum: Spectrum, k: int) -> Float[np.ndarray, "n k"]:
    """Return the k lowest modes of the shape scaled to area 1: φ_i √A."""
    return spectrum.eigenvectors[:, :k] * np.sqrt(spectrum.point_areas.sum())


def unit_projector(spectrum: Spectrum, k: int) -> Float[np.ndarray, "n k"]:
    """Return B φ_i / √A, whose transpose gives the coefficients of a function in `unit_modes`."""
    return spectrum.mass @ unit_modes(spectrum, k) / spectrum.point_areas.sum()


@one_blas_thread()
def transfer_function(mapping: FunctionalMap, values: ArrayLike) -> Float[np.ndarray, "n2 ..."]:
    """Transfer functions from the source of a functional map to its target.

    The function is projected on the modes of the source, mapped, and expanded in those of the
    target.

    Parameters
    ----------
    mapping : FunctionalMap
    values : (n1,) or (n1, q) float
        Functions on the source, in any unit. Components outside its k1 modes are lost.

    Returns
    -------
    (n2,) or (n2, q) float
        Functions on the target, in the same unit. Constant functions are preserved.

    Raises
    ------
    InvalidParameterError
        If `values` does not have one finite row for each vertex of the source.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 8)
    >>> identity = es.functional_map(spectrum, spectrum, [[0, 0], [50, 50]], n_modes=6)
    >>> smooth = es.spectral.transfer_function(identity, mesh.vertices)
    >>> smooth.shape
    (288, 3)
    """
    require_type(mapping, FunctionalMap, "mapping")
    functions = point_functions(values, "values", len(mapping.source.eigenvectors))
    k2, k1 = mapping.matrix.shape
    coefficients = mapping.matrix @ (unit_projector(mapping.source, k1).T @ functions)
    return unit_modes(mapping.target, k2) @ coefficients
