"""Parcels of a surface: named and colored groups of vertices, and means of functions over them."""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import ReadOnly, freeze, real_numbers, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.simplices import dual_volumes

GOLDEN = (5**0.5 - 1) / 2  # turns of the hue from one color to the next: no two of many are close
MOST = 2**31 - 2  # of a label in 32 bits


@dataclass(frozen=True, eq=False, init=False)
class Parcellation(ReadOnly):
    """A parcel for each vertex of a surface, such as an atlas of a cortex.

    Attributes
    ----------
    labels : (n,) int
        Parcel of each vertex, a place in `names`; -1 for none, as on the medial wall.
    names : tuple of str
        Name of each of the p parcels. By default "parcel 0" and so on, up to the largest label.
    colors : (p, 4) float
        Red, green, blue and opacity of each parcel, from 0 to 1. By default different hues.

    Raises
    ------
    InvalidParameterError
        If a label is not a place in `names` or -1, or there is not one color for each name.

    See Also
    --------
    parcellate : Average a function over parcels.
    es.io.read_parcellation : Read a file.

    Examples
    --------
    >>> import eigenshape as es
    >>> halves = es.features.Parcellation([0, 0, 1, -1], ("front", "back"))
    >>> halves.colors.shape
    (2, 4)
    """

    labels: Int[np.ndarray, " n"]
    names: tuple[str, ...]
    colors: Float[np.ndarray, "p 4"]

    def __init__(
        self,
        labels: ArrayLike,
        names: Sequence[str] | None = None,
        colors: ArrayLike | None = None,
    ) -> None:
        places = whole_numbers(labels, "A label", -1, MOST)
        n_parcels = int(places.max(initial=-1)) + 1
        chosen = [f"parcel {i}" for i in range(n_parcels)] if names is None else list(names)
        require_each(chosen, str, "names")
        if len(chosen) < n_parcels:
            vertex = int(places.argmax())
            raise InvalidParameterError(
                f"labels must be places in names or -1; that of vertex {vertex} is {places[vertex]}, "
                f"and there are {len(chosen)} names."
            )
        hues = [colorsys.hsv_to_rgb(i * GOLDEN % 1, 0.65, 0.9) for i in range(len(chosen))]
        shades = real_numbers([(*hue, 1.0) for hue in hues] if colors is None else colors, "colors")
        shades = shades.astype(np.float64)
        if shades.size == len(chosen) == 0:
            shades = np.empty((0, 4))
        if shades.shape != (len(chosen), 4) or not ((shades >= 0) & (shades <= 1)).all():
            raise InvalidParameterError(
                f"colors must be ({len(chosen)}, 4) numbers in 0..1, one row for each name; the shape "
                f"is {shades.shape}."
            )
        vars(self).update(labels=freeze(places), names=tuple(chosen), colors=freeze(shades))

    def require_vertices(self, n_vertices: int) -> None:
        """Raise an error if the parcels are not those of a surface with so many vertices.

        Parameters
        ----------
        n_vertices : int
            Number of vertices of the surface.

        Raises
        ------
        InvalidParameterError
            If there is not one label for each.
        """
        if len(self.labels) != n_vertices:
            raise InvalidParameterError(
                f"A parcellation must have a label for each of {n_vertices} vertices; it has "
                f"{len(self.labels)}, so it belongs to another surface."
            )


def parcellate(
    mesh: MeshLike, values: ArrayLike, parcellation: Parcellation
) -> Float[np.ndarray, "p ..."]:
    """Average functions over each parcel, weighted by the area at each vertex.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    values : (n,) or (n, k) float
        One function or k of them. NaN is allowed only where there is no parcel.
    parcellation : Parcellation
        Of the n vertices.

    Returns
    -------
    (p,) or (p, k) float
        NaN for a parcel without vertices.

    Raises
    ------
    InvalidParameterError
        If `values` or the parcellation is of another number of vertices, or a value in a parcel is
        not finite.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> halves = es.features.Parcellation((ball.vertices[:, 2] > 0).astype(int))
    >>> es.features.parcellate(ball, ball.vertices[:, 2], halves).round(1).tolist()
    [-0.5, 0.5]
    """
    mesh = as_mesh(mesh)
    require_type(parcellation, Parcellation, "parcellation")
    parcellation.require_vertices(mesh.n_vertices)
    labels, n_parcels = parcellation.labels, len(parcellation.names)
    (inside,) = np.nonzero(labels >= 0)
    rows = real_numbers(values, "values")
    if rows.ndim not in (1, 2) or len(rows) != mesh.n_vertices:
        raise InvalidParameterError(
            f"values must hold one row per vertex, shape ({mesh.n_vertices},) or "
            f"({mesh.n_vertices}, k); the shape is {rows.shape}."
        )
    rows = rows.astype(np.float64)
    is_finite = np.isfinite(rows).all(axis=tuple(range(1, rows.ndim)))
    bad = np.flatnonzero(~is_finite & (labels >= 0))
    if bad.size:
        name = parcellation.names[labels[bad[0]]]
        raise InvalidParameterError(
            f"values must be finite in parcels; vertex {bad[0]} of {name!r} has {rows[bad[0]]} "
            f"({bad.size} such). Give such vertices the label -1."
        )
    weights = dual_volumes(mesh)[inside]
    shape = (n_parcels, len(inside))
    sums = sp.csr_array((weights, (labels[inside], np.arange(len(inside)))), shape=shape)
    areas = sums.sum(axis=1)
    with np.errstate(invalid="ignore"):  # a parcel without vertices has the mean 0 / 0
        return (sums @ rows[inside]) / areas.reshape(-1, *[1] * (rows.ndim - 1))
