"""How close two shapes are: the least δ of thesis 3.1 and 4.1."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arguments import require_type
from eigenshape._arrays import finite_rows, frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.enclosing_ball import enclosing_ball
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import require_volumes, size_one, volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.stability.perturbation import Perturbation, measure_perturbation, vertex_pairs

Limit = Literal["nothing", "displacement", "Jacobian", "ball", "volume"]


@dataclass(frozen=True, eq=False)
class Closeness:
    """What condition C1 and C2 of δ-closeness ask about, measured (thesis 4.1).

    Attributes
    ----------
    displacement : (v,) float
        |x - Φ(x)| at the vertices outside the regions, in the order of `vertex_pairs`, in length. On a face it is
        largest at a corner.
    jacobians : (f,) float
        Volume of Φ(face) over that of the face, for the faces outside, without unit.
    radii : (r,) float
        Radius of the smallest ball that holds X_i and Y_i together, in length.
    volume_ratios : (r,) float
        vol(Y_i) / vol(X_i), without unit.
    size : float
        vol(M)^(1/m), in length. The thesis measures lengths on an M of volume 1: all are divided by this.
    delta : float
        The least δ for which the shapes are δ-close, without unit: the largest of displacement/size, |jacobian - 1|,
        radius/size and |volume ratio - 1|.
    limited_by : "nothing", "displacement", "Jacobian", "ball" or "volume"
        Which of these it is; "nothing" where δ = 0.
    """

    displacement: Float[np.ndarray, " v"]
    jacobians: Float[np.ndarray, " f"]
    radii: Float[np.ndarray, " r"]
    volume_ratios: Float[np.ndarray, " r"]
    size: float
    delta: float
    limited_by: Limit

    def explain(self) -> str:
        """Say in plain words how close the shapes are, and what decides it."""
        parts = _parts(self.displacement, self.jacobians, self.radii, self.volume_ratios, self.size)
        outside = (
            f"{'Outside the anomalous regions points' if len(self.radii) else 'Points'} move by up to "
            f"{_most(self.displacement):.3g} ({_most(parts['displacement']):.3g} of the size {self.size:.3g}), "
            f"and the volumes of simplices change by up to {_most(parts['Jacobian']):.3g} of themselves."
        )
        inside = (
            f" Each of the {len(self.radii)} anomalous regions lies, with what replaces it, in a ball of radius at "
            f"most {_most(self.radii):.3g} ({_most(parts['ball']):.3g} of the size), and its volume changes by up to "
            f"{_most(parts['volume']):.3g} of itself."
        )
        decides = {
            "nothing": "the shapes are the same",
            "displacement": "how far points move decides",
            "Jacobian": "how much volumes outside change decides",
            "ball": "the size of the regions decides",
            "volume": "how much the volume of a region changes decides",
        }[self.limited_by]
        regions = inside if len(self.radii) else ""
        return f"{outside}{regions} The shapes are δ-close from δ = {self.delta:.3g}: {decides}."


def measure_closeness(perturbation: Perturbation) -> Closeness:
    """Measure for which δ two shapes are δ-close (thesis 4.1; without regions δ_H of 3.1, with factor 1 in its O).

    C1: outside the regions |x - Φ(x)| ≤ δ and 1 - δ ≤ JΦ ≤ 1 + δ. C2: X_i and Y_i lie in one ball of radius δ, the same
    for both, and (1 - δ) vol(X_i) ≤ vol(Y_i) ≤ (1 + δ) vol(X_i). Lengths are those of the shapes scaled to vol(M) = 1.

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
    """
    require_type(perturbation, Perturbation, "perturbation")
    require_volumes(perturbation.one)
    here, there, scale = _scaled(perturbation)
    pairs = vertex_pairs(perturbation)
    volumes_one, volumes_two = (
        volumes(points[mesh.simplices])
        for points, mesh in ((here, perturbation.one), (there, perturbation.two))
    )
    regions = range(perturbation.n_regions)
    return _closeness(
        scale * np.linalg.norm(here[pairs[:, 0]] - there[pairs[:, 1]], axis=1),
        volumes_two[perturbation.outside_two] / volumes_one[perturbation.outside_one],
        scale * np.array([_radius(perturbation, here, there, region) for region in regions]),
        _sums(volumes_two, perturbation.regions_two) / _sums(volumes_one, perturbation.regions_one),
        scale * float(volumes_one.sum()) ** (1 / perturbation.one.dim),
    )


def map_closeness(mesh: MeshLike, images: ArrayLike) -> Closeness:
    """Measure for which δ_H a shape and its image are δ_H-close (thesis 3.1).

    Parameters
    ----------
    mesh : MeshLike
    images : (n, d) float
        Where the map takes the vertices, in length; it is linear on each face.

    Returns
    -------
    Closeness
        Without regions.

    Raises
    ------
    InvalidShapeError
        If a simplex has no volume, or an image is not finite.
    InvalidParameterError
        If there is not one image a vertex.
    """
    mesh = as_simplicial(mesh)
    places = finite_rows(images, "points", mesh.points.shape[1])
    if len(places) != mesh.n_points:
        raise InvalidParameterError(
            f"A map must have one image a vertex; there are {len(places)} images of {mesh.n_points} vertices."
        )
    kind = TriangleMesh if isinstance(mesh, TriangleMesh) else SimplicialMesh
    return measure_closeness(measure_perturbation(mesh, kind(places, mesh.simplices)))


def _scaled(
    perturbation: Perturbation,
) -> tuple[Float[np.ndarray, "n d"], Float[np.ndarray, "k d"], float]:
    """Return the points of both shapes divided by one power of two, and that power."""
    n = perturbation.one.n_points
    points, scale = size_one(np.concatenate([perturbation.one.points, perturbation.two.points]))
    return points[:n], points[n:], scale


def _radius(
    perturbation: Perturbation,
    here: Float[np.ndarray, "n d"],
    there: Float[np.ndarray, "k d"],
    region: int,
) -> float:
    corners_one = perturbation.one.simplices[perturbation.regions_one == region]
    corners_two = perturbation.two.simplices[perturbation.regions_two == region]
    return enclosing_ball(
        np.concatenate([here[np.unique(corners_one)], there[np.unique(corners_two)]])
    ).radius


def _parts(
    displacement: Float[np.ndarray, " v"],
    jacobians: Float[np.ndarray, " f"],
    radii: Float[np.ndarray, " r"],
    volume_ratios: Float[np.ndarray, " r"],
    size: float,
) -> dict[Limit, Float[np.ndarray, " _"]]:
    return {
        "displacement": displacement / size,
        "Jacobian": np.abs(jacobians - 1),
        "ball": radii / size,
        "volume": np.abs(volume_ratios - 1),
    }


def _closeness(
    displacement: Float[np.ndarray, " v"],
    jacobians: Float[np.ndarray, " f"],
    radii: Float[np.ndarray, " r"],
    volume_ratios: Float[np.ndarray, " r"],
    size: float,
) -> Closeness:
    parts = _parts(displacement, jacobians, radii, volume_ratios, size)
    largest = {name: _most(part) for name, part in parts.items()}
    limit = max(largest, key=lambda name: largest[name])
    return Closeness(
        displacement=frozen(displacement),
        jacobians=frozen(jacobians),
        radii=frozen(radii),
        volume_ratios=frozen(volume_ratios),
        size=size,
        delta=largest[limit],
        limited_by=limit if largest[limit] else "nothing",
    )


def _sums(
    values: Float[np.ndarray, " s"], labels: Int[np.ndarray, " s"]
) -> Float[np.ndarray, " r"]:
    """Sum the values of each region."""
    return np.bincount(labels + 1, weights=values, minlength=labels.max() + 2)[1:]


def _most(values: Float[np.ndarray, " _"]) -> float:
    return float(values.max(initial=0.0))
