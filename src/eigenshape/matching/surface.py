"""Surfaces as matching sees them: points, their patches, and distances and directions from them."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from jaxtyping import Complex64, Float, Float32, Int

from certeig.kit.arrays import TINY, ReadOnly, record
from eigenshape._corners import mean_normals
from eigenshape._vectors import frames_across
from eigenshape.geometry.distances.geodesic import farthest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import neighbor_links
from eigenshape.matching.nearest import RowTree
from eigenshape.retrieval.patches.codebook import BASES, default_codebook, whiten_numbers
from eigenshape.retrieval.patches.patch_loops import (
    HEIGHT_BINS,
    RING_NUMBERS,
    RINGS,
    TURN_BINS,
)
from eigenshape.retrieval.patches.patches import RADII, describe_discs, whole_shares

# The unit of length, in roots of the area of the whole. Patches are described in sides of a box,
# which for animals is about 1.2 roots of the area; the box itself changes with the pose, from 0.7
# for a cat that curls up to 1.3 for one that stretches.
UNIT = 1.2
MATCHED_RADII = RADII[list(BASES)]  # of the discs that are compared, in units

NORMAL_LENGTH = 0.08  # length, in units, that a difference of normals counts for


@record
class View(ReadOnly):
    """Points of a whole, by number, that one viewpoint sees, and their whitened discs there."""

    points: Int[np.ndarray, " q"]
    numbers: Float32[np.ndarray, "q r d"]
    weights: Float32[np.ndarray, "q r"]


@record
class Surface(ReadOnly):
    """A mesh in the unit of the whole, and m of its vertices with what matching compares.

    `distances` are from the points to all vertices, `columns` the same as rows of vertices, and
    `between` from point to point. `ways` holds the direction at each point (row) of the shortest
    path to each other one, as a complex number of modulus 1 at most in a tangent frame; it is
    shorter where several paths are about as short. `views` are what viewpoints see of a whole.
    """

    mesh: TriangleMesh
    areas: Float[np.ndarray, " n"]
    normals: Float[np.ndarray, "n 3"]
    points: Int[np.ndarray, " m"]
    distances: Float32[np.ndarray, "m n"]
    columns: Float32[np.ndarray, "n m"]
    nearest: Int[np.ndarray, " n"]
    numbers: Float32[np.ndarray, "m r d"]
    weights: Float32[np.ndarray, "m r"]
    turned_numbers: Float32[np.ndarray, "m r d"]
    between: Float32[np.ndarray, "m m"]
    ways: Complex64[np.ndarray, "m m"]
    views: tuple[View, ...] = ()

    @property
    def area(self) -> float:
        """Area in square units."""
        return float(self.areas.sum())

    def tree(self) -> RowTree:
        """Return vertices with their normals, in which all fits to a whole look for the nearest ones."""
        return self._tree

    @cached_property
    def _tree(self) -> RowTree:
        return RowTree(np.hstack([self.mesh.vertices, NORMAL_LENGTH * self.normals]))


def describe_surface(mesh: TriangleMesh, unit: float, n_points: int) -> Surface:
    """Scale a surface that faces outward and has no noise, choose points, and describe them."""
    mesh = TriangleMesh((mesh.vertices - mesh.vertices.mean(axis=0)) / unit, mesh.faces)
    count = min(n_points, mesh.n_vertices)
    chosen, rows, nearest = farthest_points(mesh, count)
    areas, normals = dual_volumes(mesh), mean_normals(mesh)
    numbers = describe_discs(mesh, chosen, rows, MATCHED_RADII, normals, areas)
    weights = whole_shares(mesh, rows, MATCHED_RADII)
    # Turned inside out, the heights of discs change their signs.
    turned = numbers.copy()
    for ring in range(RINGS):
        first = ring * RING_NUMBERS + TURN_BINS
        heights = slice(first, first + HEIGHT_BINS)
        turned[:, :, heights] = numbers[:, :, heights][:, :, ::-1]
    distances = rows.astype(np.float32)
    return Surface(
        mesh,
        areas,
        normals,
        chosen,
        distances,
        np.ascontiguousarray(distances.T),
        nearest,
        whiten_discs(numbers),
        weights.astype(np.float32),
        whiten_discs(turned),
        np.ascontiguousarray(distances[:, chosen]),
        _directions(mesh, chosen, rows, normals),
    )


def turn_over(surface: Surface) -> Surface:
    """Return a surface turned inside out."""
    mesh = surface.mesh
    return replace(
        surface,
        mesh=TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]),
        normals=-surface.normals,
        numbers=surface.turned_numbers,
        turned_numbers=surface.numbers,
        # A frame seen from the other side is mirrored.
        ways=np.conj(surface.ways),
    )


def whiten_discs(numbers: Float32[np.ndarray, "m r c"]) -> Float32[np.ndarray, "m r d"]:
    """Whiten the numbers at each radius by the codebook that comes with the library."""
    codebook = default_codebook()
    rows = [whiten_numbers(numbers[:, place], codebook, place) for place in range(len(BASES))]
    return np.stack(rows, axis=1).astype(np.float32)


def _directions(
    mesh: TriangleMesh,
    points: Int[np.ndarray, " m"],
    rows: Float[np.ndarray, "m n"],
    normals: Float[np.ndarray, "n 3"],
) -> Complex64[np.ndarray, "m m"]:
    """Return the direction at each point towards each other one: minus the gradient of a distance.

    The gradient is fitted to the vertices of two rings around the point, in its tangent plane.
    """
    links = neighbor_links(mesh)
    rings = (links + links @ links)[points].tocsr()
    number = np.repeat(np.arange(len(points)), np.diff(rings.indptr))
    frames = frames_across(normals[points])
    # Unfold the arms into the tangent planes, with their lengths.
    arms = mesh.vertices[rings.indices] - mesh.vertices[points][number]
    flat = np.einsum("eij,ej->ei", frames[number], arms)
    lengths = np.linalg.norm(flat, axis=1)
    stretch = np.linalg.norm(arms, axis=1) / np.maximum(lengths, TINY)
    flat *= stretch[:, None]
    # Least squares by the normal equations of each point, the shortest slope where arms lie on a line
    grams = np.add.reduceat(flat[:, :, None] * flat[:, None], rings.indptr[:-1])
    shares = np.einsum("eij,ej->ei", np.linalg.pinv(grams, hermitian=True)[number], flat)
    columns = np.ascontiguousarray(rows.T)
    columns[~np.isfinite(columns)] = 0  # other components, which lie in no direction
    slopes = []
    for along in np.ascontiguousarray(shares.T):
        fit = sp.csr_array((along, rings.indices, rings.indptr), shape=rings.shape)
        slopes.append(fit @ columns - fit.sum(axis=1)[:, None] * columns[points])
    found = -(slopes[0] + 1j * slopes[1]).astype(np.complex64)
    return found / np.maximum(np.abs(found), 1)
