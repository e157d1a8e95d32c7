"""Angles between the eigenspaces of two shapes, measured, and bounded by gaps (thesis 3.5)."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from certeig.solver.certify import quality
from certeig.solver.eigenpairs import Pairs
from certeig.solver.pencil import Pencil
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.comparison.eigenspaces import (
    SEPARATED,
    corresponding_points,
    orthonormal,
    principal_angles,
    separated_groups,
)
from eigenshape.spectral.kernel_values import to_pencil
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum

Vectors = Float[np.ndarray, "n p"]


@record
class EigenspaceAngles(ReadOnly):
    """How far the eigenspaces of a shape rotate when it is deformed into another.

    Attributes
    ----------
    starts, stops : (g,) int
        Group j consists of the eigenvalues number starts[j] to stops[j] - 1.
    angles : (g,) float
        Largest principal angle between the two spaces of a group, in radians, 0 to π/2.
    gaps : (g,) float
        Distance of the group from the nearest other eigenvalue of the first shape, in 1/length².
    bounds : (g,) float or None
        Upper bound of each angle, in radians; π/2 if there is no bound. None without an operator.

    See Also
    --------
    es.spectral.eigenspace_angles : Compute the angles.

    Examples
    --------
    A torus is stretched by 1 %. The functions of a group of eigenvalues mix among themselves, but
    the space that they span hardly turns:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> longer = es.TriangleMesh(mesh.vertices * [1.0, 1.0, 1.01], mesh.faces)
    >>> one, two = (es.solve_spectrum(es.cotangent_laplacian(m), 10) for m in (mesh, longer))
    >>> found = es.spectral.eigenspace_angles(one, two)
    >>> found.starts[:3].tolist(), found.stops[:3].tolist()  # numbers 0; 1 and 2; 3 and 4
    ([0, 1, 3], [1, 3, 5])
    >>> bool(np.degrees(found.angles).max() < 1)
    True
    """

    starts: Int[np.ndarray, " g"]
    stops: Int[np.ndarray, " g"]
    angles: Float[np.ndarray, " g"]
    gaps: Float[np.ndarray, " g"]
    bounds: Float[np.ndarray, " g"] | None

    def explain(self) -> str:
        """Return a text that says how far the spaces rotate, and how many angles are bounded."""
        if not len(self.angles):
            return "No group of eigenvalues is known completely."
        worst = int(self.angles.argmax())
        start, last = self.starts[worst], self.stops[worst] - 1
        numbers = f"number {start}" if start == last else f"numbers {start} to {last}"
        degrees = np.degrees([np.median(self.angles), self.angles[worst]])
        summary = (
            f"The eigenspaces of {len(self.angles)} groups turn by {degrees[0]:.3g}° in the median and by at most "
            f"{degrees[1]:.3g}° ({numbers})."
        )
        if self.bounds is None:
            return summary
        n_bounded = np.count_nonzero(self.bounds < np.pi / 2)
        return f"{summary} For {n_bounded} of them the gap proves a bound below a right angle."


@one_blas_thread()
def eigenspace_angles(
    one: Spectrum,
    two: Spectrum,
    *,
    points: ArrayLike | None = None,
    laplacian: Laplacian | None = None,
    ratio: float = SEPARATED,
) -> EigenspaceAngles:
    """Measure how far eigenspaces rotate between two shapes, and bound the angles (thesis 3.5).

    Groups are the `separated_groups` of `one` that are known completely. The eigenvectors of `two`
    with the same numbers are pulled back to the points of `one` (thesis, lemma 3.2.1) and
    orthonormalized in its mass.

    With the operator (W, B) of `one` the angle has a bound. Let V be that basis, H = VᵀWV, R = WV -
    BVH, and δ the distance between the interval spanned by the eigenvalues of H and all eigenvalues
    of `one` outside the group. Then sin θ ≤ ‖R‖/δ, with the largest singular value in B⁻¹ (Davis
    and Kahan 1970, the sin θ theorem; Parlett 1998, section 11.7), since X = U⊥ᵀBV, U⊥ the other
    eigenvectors, solves Λ⊥X - XH = U⊥ᵀR. The eigenvectors of `one` have the same kind of bound by
    their own residuals, which is added. Eigenvalues have errors of at most √2 times the norm of all
    residuals, by which the gap is reduced. The bound depends on `two` only through V: it is a
    posteriori, and gives no information if eigenvalues change places.

    Parameters
    ----------
    one, two : Spectrum
        From the lowest eigenvalue on.
    points : (n_one,) int, optional
        The point of `two` that corresponds to each point of `one`. The default is the point of the
        same number.
    laplacian : Laplacian, optional
        The operator of `one`.
    ratio : float
        As in `separated_groups`.

    Returns
    -------
    EigenspaceAngles

    Raises
    ------
    InvalidParameterError
        If a spectrum does not begin with the lowest eigenvalue, the points do not fit, the
        pulled-back eigenvectors are dependent, or `laplacian` is given and `one` is not certified
        or has other points.
    ConvergenceError
        If `laplacian` is not the operator of `one`.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.torus(24, 12)
    >>> bumpy = es.TriangleMesh(mesh.vertices * [1.0, 1.0, 1.01], mesh.faces)
    >>> laplacian = es.cotangent_laplacian(mesh)
    >>> one, two = (es.solve_spectrum(es.cotangent_laplacian(m), 10) for m in (mesh, bumpy))
    >>> found = es.spectral.eigenspace_angles(one, two, laplacian=laplacian)
    >>> bool((found.angles <= found.bounds).all())
    True
    """
    require_lowest(one, "one")
    require_lowest(two, "two")
    require_type(laplacian, Laplacian | None, "laplacian")
    partners = corresponding_points(points, one, two, ("one", "two"))
    groups = [
        group
        for group in separated_groups(one.eigenvalues, ratio=ratio)
        if group.stop < len(one.eigenvalues) and group.stop <= len(two.eigenvalues)
    ]
    exact = None if laplacian is None else _unit_pairs(one, laplacian)
    angles, bounds = np.empty(len(groups)), np.empty(len(groups))
    for place, group in enumerate(groups):
        name = f"Eigenvectors {group.start} to {group.stop - 1} of two"
        pulled = orthonormal(two.eigenvectors[partners, group], one.mass, name)
        angles[place] = principal_angles(one.eigenvectors[:, group], pulled, one.mass)[-1]
        bounds[place] = np.pi / 2 if exact is None else _bound(*exact, group, pulled)
    steps = np.concatenate([[np.inf], np.diff(one.eigenvalues)])
    starts, stops = (
        np.array([getattr(group, end) for group in groups], dtype=np.int64)
        for end in ("start", "stop")
    )
    return EigenspaceAngles(
        starts=starts,
        stops=stops,
        angles=angles,
        gaps=np.minimum(steps[starts], steps[stops]),
        bounds=None if exact is None else bounds,
    )


def _unit_pairs(one: Spectrum, laplacian: Laplacian) -> tuple[Pencil, Pairs]:
    """Return the operator, and eigenpairs with residuals, in units of its own."""
    if laplacian.n_points != len(one.eigenvectors):
        raise InvalidParameterError(
            f"laplacian must be the operator that one is of; they have {laplacian.n_points} and "
            f"{len(one.eigenvectors)} points."
        )
    if one.certificate.count is None:
        raise InvalidParameterError(
            "Bounds of angles need a certified spectrum; the eigenvalues of one were not counted. Solve with "
            "method='certified'."
        )
    pencil = normalize(laplacian)
    values = np.ldexp(to_pencil(laplacian.kernel, one.eigenvalues), -pencil.value_exponent)
    vectors = np.ldexp(one.eigenvectors, -pencil.vector_exponent)
    pairs = Pairs(values, vectors, pencil.residual_norms(values, vectors))
    quality(pencil, pairs)
    return pencil, pairs


def _bound(pencil: Pencil, pairs: Pairs, group: slice, pulled: Vectors) -> float:
    """Return the bound of Davis and Kahan for the pulled space, with that for the eigenvectors themselves."""
    basis = np.ldexp(pulled, -pencil.vector_exponent)
    moved = pencil.stiffness @ basis
    inner = basis.T @ moved
    residual = moved - pencil.weigh(basis @ inner)
    squares = (residual / pencil.mass_diagonal[:, None]).T @ residual
    size = np.sqrt(max(np.linalg.eigvalsh(squares)[-1], 0.0) / pencil.mass_floor)
    own = float(np.linalg.norm(pairs.residuals[group]))
    turned = _sine_bound(float(size), _distance(pairs, group, np.linalg.eigvalsh(inner)))
    return min(
        turned + _sine_bound(own, _distance(pairs, group, pairs.values[group])), float(np.pi / 2)
    )


def _distance(pairs: Pairs, group: slice, inside: Float[np.ndarray, " p"]) -> float:
    """Return how far the interval of some values is from the eigenvalues outside a group."""
    stray = np.sqrt(2) * pairs.error_bound
    above = pairs.values[group.stop] - stray - inside[-1]
    if group.start == 0:
        return float(above)
    return float(min(above, inside[0] - pairs.values[group.start - 1] - stray))


def _sine_bound(size: float, distance: float) -> float:
    return float(np.arcsin(size / distance)) if size < distance else float(np.pi / 2)
