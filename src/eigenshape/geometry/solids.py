"""Hexahedra, wedges and pyramids, split into tetrahedra whose faces match."""

import numpy as np

from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.simplicial import SimplicialMesh

# The faces of a solid by its number of corners, each seen from outside in one sense of rotation.
# The order of corners is that of VTK, gmsh and Medit files.
FACES = {
    5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: (
        (0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7),
    ),
}  # fmt: skip
NAMES = {5: "pyramid", 6: "wedge", 8: "hexahedron"}
N_TETRAHEDRA = {5: 2, 6: 3, 8: 6}


def split_solids(points: ArrayLike, solids: ArrayLike) -> SimplicialMesh:
    """Split hexahedra, wedges or pyramids into tetrahedra.

    Every face with four corners is cut from its corner with the smallest index, and the solid is
    cut into pyramids with its own smallest corner as tip (Dompierre, Labbé, Vallet and Camarero
    1999). Neighbors cut a common face in the same way, so the tetrahedra match, and no point and no
    volume is added.

    Parameters
    ----------
    points : (n, 3) float
        In length.
    solids : (c, 8), (c, 6) or (c, 5) int
        Corners of hexahedra, wedges or pyramids, in the order of VTK, gmsh and Medit files: the
        base, then what lies above it.

    Returns
    -------
    SimplicialMesh
        6 tetrahedra a hexahedron, 3 a wedge, 2 a pyramid, in the order of the solids.

    Raises
    ------
    InvalidShapeError
        If the solids do not have 8, 6 or 5 corners, a corner is not the index of a point, or a
        solid is inverted: one of its tetrahedra has no volume, or one of the other sign than most.

    See Also
    --------
    boundary_surface : The triangles around tetrahedra.

    Examples
    --------
    >>> import eigenshape as es
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> points = corners + [[x, y, 1] for x, y, _ in corners]
    >>> cube = es.geometry.split_solids(points, [range(8)])
    >>> cube.n_simplices, es.geometry.simplex_volumes(cube).sum().round(12).item()
    (6, 1.0)
    """
    places = finite_rows(points, "points", 3)
    corners = np.asarray(solids)
    if corners.ndim != 2 or corners.shape[1] not in FACES or corners.dtype.kind not in "iu":
        raise InvalidShapeError(
            "solids must be a table of 8, 6 or 5 whole numbers a row; it is "
            f"{corners.dtype} of shape {corners.shape}."
        )
    beyond = np.flatnonzero(((corners < 0) | (corners >= len(places))).any(axis=1))
    if beyond.size:
        raise InvalidShapeError(
            f"Corners of solids must be indices of the {len(places)} points; solid {beyond[0]} is "
            f"{corners[beyond[0]].tolist()} ({beyond.size} such)."
        )
    # Join the smallest corner of each solid to the triangles of the faces that it does not touch.
    corners = corners.astype(np.int64)
    n_corners = corners.shape[1]
    lowest = corners.argmin(axis=1)
    tetrahedra = np.empty((len(corners), N_TETRAHEDRA[n_corners], 4), dtype=np.int64)
    for tip in range(n_corners):
        rows = np.flatnonzero(lowest == tip)
        some = corners[rows]
        triangles = []
        for face in FACES[n_corners]:
            if tip in face:
                continue
            ring = some[:, face]
            turn = ring.argmin(axis=1)[:, None] + np.arange(len(face))
            ring = np.take_along_axis(ring, turn % len(face), axis=1)
            triangles += [ring[:, [0, i, i + 1]] for i in range(1, len(face) - 1)]
        tetrahedra[rows, :, 0] = some[:, [tip]]
        tetrahedra[rows, :, 1:] = np.stack(triangles, axis=1)
    # Volumes with a sign: positive where the corners turn as those of the formats do
    tip, a, b, c = np.moveaxis(size_one(places)[0][tetrahedra], 2, 0)
    volumes = np.einsum("ctd,ctd->ct", np.cross(b - a, c - a), a - tip) / 6
    if volumes.sum() < 0:  # all are mirrored
        volumes = -volumes
        tetrahedra = tetrahedra[:, :, [0, 2, 1, 3]]
    inverted = np.flatnonzero((volumes <= 0).any(axis=1))
    if inverted.size:
        name = NAMES[corners.shape[1]]
        raise InvalidShapeError(
            f"Solids must not be inverted or flat where they are split; {name} {inverted[0]} with the "
            f"corners {corners[inverted[0]].tolist()} has a tetrahedron that is ({inverted.size} "
            "such). No repair mends that; leave it out, or mesh the solid anew."
        )
    return SimplicialMesh(places, tetrahedra.reshape(-1, 4))
