"""Closeness of two shapes: the smallest δ of thesis 3.1 and 4.1."""

from dataclasses import replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from eigenshape._vectors import size_one
from eigenshape.geometry.enclosing_ball import enclosing_ball
from eigenshape.geometry.requirements import require_volumes
from eigenshape.geometry.simplices import volumes
from eigenshape.stability.perturbation import Perturbation, vertex_pairs

Limit = Literal["nothing", "displacement", "Jacobian", "ball", "volume"]


@record
class Closeness(ReadOnly):
    """The quantities in conditions C1 and C2 of δ-closeness (thesis 4.1).

    Attributes
    ----------
    displacement : (v,) float
        |x - Φ(x)| at the vertices outside the regions, in the order of `vertex_pairs`, in length.
        On a face it is largest at a corner.
    jacobians : (f,) float
        Volume of Φ(face) divided by that of the face, for the faces outside the regions.
    radii : (r,) float
        Radius of the smallest ball that contains X_i and Y_i, in length.
    volume_ratios : (r,) float
        vol(Y_i) / vol(X_i), without unit.
    size : float
        vol(M)^(1/m), in length. The thesis measures lengths on an M of volume 1: all lengths are
        divided by this.
    delta : float
        Smallest δ for which the shapes are δ-close, without unit: the largest of displacement/size,
        |jacobian - 1|, radius/size and |volume ratio - 1|.
    limited_by : "nothing", "displacement", "Jacobian", "ball" or "volume"
        Which of these quantities determines δ; "nothing" if δ = 0.

    See Also
    --------
    measure_closeness : Closeness of a shape and a changed shape.

    Examples
    --------
    A uniform stretch to twice the size changes areas most:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> larger = es.TriangleMesh(2 * mesh.vertices, mesh.faces)
    >>> closeness = es.stability.measure_closeness(es.stability.measure_perturbation(mesh, larger))
    >>> closeness.limited_by, round(closeness.delta, 6)
    ('Jacobian', 3.0)
    """

    displacement: Float[np.ndarray, " v"]
    jacobians: Float[np.ndarray, " f"]
    radii: Float[np.ndarray, " r"]
    volume_ratios: Float[np.ndarray, " r"]
    size: float
    delta: float
    limited_by: Limit

    def explain(self) -> str:
        """Describe in plain words how close the shapes are, and what limits δ."""
        parts = self._largest_changes()
        points = "Outside the anomalous regions points" if len(self.radii) else "Points"
        text = (
            f"{points} move by up to {_largest(self.displacement):.3g} "
            f"({parts['displacement']:.3g} of the size {self.size:.3g}), and the volumes "
            f"of simplices change by a factor of up to 1 ± {parts['Jacobian']:.3g}."
        )
        if len(self.radii):
            text += (
                f" Each of the {len(self.radii)} anomalous regions and its replacement lie in a "
                f"ball of radius {_largest(self.radii):.3g} or less "
                f"({parts['ball']:.3g} of the size), and its volume changes by a factor "
                f"of up to 1 ± {parts['volume']:.3g}."
            )
        limit = {
            "nothing": "the shapes are the same",
            "displacement": "the displacement of points is the largest change",
            "Jacobian": "the volume of simplices outside the regions is the largest change",
            "ball": "the size of the regions is the largest change",
            "volume": "the volume of a region is the largest change",
        }[self.limited_by]
        return (
            f"{text} The smallest δ for which the shapes are δ-close is {self.delta:.3g}: {limit}."
        )

    def _largest_changes(self) -> dict[Limit, float]:
        return {
            "displacement": _largest(self.displacement / self.size),
            "Jacobian": _largest(np.abs(self.jacobians - 1)),
            "ball": _largest(self.radii / self.size),
            "volume": _largest(np.abs(self.volume_ratios - 1)),
        }


def measure_closeness(perturbation: Perturbation) -> Closeness:
    """Compute the smallest δ for which two shapes are δ-close (thesis 4.1).

    C1: outside the regions, |x - Φ(x)| ≤ δ and 1 - δ ≤ JΦ ≤ 1 + δ. C2: X_i and Y_i lie in one ball
    of radius δ, and (1 - δ) vol(X_i) ≤ vol(Y_i) ≤ (1 + δ) vol(X_i). Lengths are those of the shapes
    scaled to vol(M) = 1. Without regions, for a mesh and its image under a map, this is δ_H of
    thesis 3.1, with factor 1 in its O.

    Parameters
    ----------
    perturbation : Perturbation

    Returns
    -------
    Closeness

    Raises
    ------
    InvalidShapeError
        If a simplex of M has no volume.

    See Also
    --------
    measure_perturbation : Describe how one shape became another.

    Examples
    --------
    A stretch by a tenth moves the poles by 0.1 and changes areas by even more:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> longer = es.TriangleMesh(mesh.vertices * [1, 1, 1.1], mesh.faces)
    >>> closeness = es.stability.measure_closeness(es.stability.measure_perturbation(mesh, longer))
    >>> float(closeness.displacement.max().round(3)), closeness.limited_by
    (0.1, 'Jacobian')
    """
    require_type(perturbation, Perturbation, "perturbation")
    one, two = perturbation.one, perturbation.two
    require_volumes(one)
    # Both shapes are divided by one power of two, so that volumes neither overflow nor vanish.
    points, scale = size_one(np.concatenate([one.points, two.points]))
    here, there = points[: one.n_points], points[one.n_points :]
    volumes_one, volumes_two = volumes(here[one.simplices]), volumes(there[two.simplices])
    size = scale * float(volumes_one.sum()) ** (1 / one.dim)

    # C1: how far Φ moves points outside the regions, and how it changes volumes.
    pairs = vertex_pairs(perturbation)
    displacement = scale * np.linalg.norm(here[pairs[:, 0]] - there[pairs[:, 1]], axis=1)
    jacobians = volumes_two[perturbation.outside_two] / volumes_one[perturbation.outside_one]

    # C2: the ball around each region and its replacement, and the volumes of both.
    radii = np.empty(perturbation.n_regions)
    for region in range(perturbation.n_regions):
        corners = here[np.unique(one.simplices[perturbation.regions_one == region])]
        others = there[np.unique(two.simplices[perturbation.regions_two == region])]
        radii[region] = scale * enclosing_ball(np.concatenate([corners, others])).radius
    # Entry 0 is the outside, whose number is -1.
    sums_one = np.bincount(perturbation.regions_one + 1, volumes_one, perturbation.n_regions + 1)
    sums_two = np.bincount(perturbation.regions_two + 1, volumes_two, perturbation.n_regions + 1)
    ratios = sums_two[1:] / sums_one[1:]

    found = Closeness(displacement, jacobians, radii, ratios, size, 0.0, "nothing")
    largest = found._largest_changes()
    limit = max(largest, key=lambda name: largest[name])
    return replace(found, delta=largest[limit], limited_by=limit) if largest[limit] else found


def _largest(values: Float[np.ndarray, " _"]) -> float:
    return float(values.max(initial=0.0))
