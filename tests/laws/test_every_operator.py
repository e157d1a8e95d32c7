"""Every operator on every kind of shape, under every boundary condition, against every law that it promises.

A registered operator promises `DEFAULT_PROMISES`. One with other promises, or several forms, has rows in `TABLE`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import permutations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from registered_operators import function_of

from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import drop_duplicate_faces
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import boundary_vertices, disjoint_union
from eigenshape.operators.anisotropic import anisotropic_laplacian, curvature_tensors
from eigenshape.operators.catalog import OPERATORS
from eigenshape.operators.clouds.cloud_kernel import point_cloud_laplacian
from eigenshape.operators.clouds.gaussian import gaussian_laplacian, mesh_laplacian
from eigenshape.operators.connection import connection_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian
from eigenshape.operators.graph import graph_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.operators.robust import robust_laplacian
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.laws.operator_laws import check_operator
from eigenshape.spectral.laws.outcomes import DEFAULT_PROMISES
from eigenshape.spectral.laws.transformations import random_rotation

seeds = st.integers(0, 2**32 - 1)
few = settings(deadline=None, max_examples=3)


def turned(points, rng, noise):
    """Shake points, move them off the origin and turn them."""
    shaken = (
        points + noise * rng.standard_normal(points.shape) + rng.standard_normal(points.shape[1])
    )
    return shaken @ random_rotation(points.shape[1], rng)


def surface(rng, small=False):
    mesh = (icosphere(1), torus(10, 7), grid(6, 5), pair(), creature())[
        rng.integers(4 if small else 5)
    ]
    return TriangleMesh(turned(mesh.vertices, rng, 0.02), mesh.faces)


@cache
def creature():
    return make_creature("quadruped", n_vertices=500)


def pair():
    far = TriangleMesh(torus(9, 6).vertices + np.array([20.0, 0, 0]), torus(9, 6).faces)
    return disjoint_union(icosphere(1), far)


def slivers(rng, small=False, thinnest=1e-9):
    """A surface with vertices that nearly lie on the opposite edge of a face, or nearly on each other."""
    mesh = surface(rng, small)
    points = mesh.vertices.copy()
    for a, b, c in mesh.faces[rng.choice(mesh.n_faces, 2, replace=False)]:
        share = rng.choice([rng.uniform(0.2, 0.8), 1e-4])
        goal = share * points[a] + (1 - share) * points[b]
        points[c] = goal + 10 ** rng.uniform(np.log10(thinnest), -2) * (points[c] - goal)
    return TriangleMesh(points, mesh.faces)


def soup(rng):
    """Different faces over random points, with edges and vertices that are no manifold."""
    points = rng.standard_normal((9, 3))
    used, faces = np.unique(
        [rng.choice(9, 3, replace=False) for _ in range(20)], return_inverse=True
    )
    return drop_duplicate_faces(TriangleMesh(points[used], faces.reshape(-1, 3))).mesh


def sheet(rng):
    """A surface with boundary."""
    mesh = grid(7, 6)
    return TriangleMesh(turned(mesh.vertices, rng, 0.02), mesh.faces)


def solid(rng, codimension=None, sizes=(12, 5, 3, 2)):
    """A shaken box of simplices of dimension 1 to 4, turned in as many dimensions or in one or two more."""
    dim = int(rng.integers(1, 5))
    more = int(rng.integers(0, 3)) if codimension is None else codimension
    mesh = box(sizes[dim - 1], dim)
    flat = np.pad(mesh.points, ((0, 0), (0, more)))
    return SimplicialMesh(turned(flat, rng, 0.02 / len(flat) ** (1 / dim)), mesh.simplices)


@cache
def box(n, dim):
    """Cut the cubes of a box along their diagonals (Kuhn): simplex by simplex from corner to opposite corner."""
    corners = np.stack(np.meshgrid(*[np.arange(n + 1)] * dim, indexing="ij"), axis=-1).reshape(
        -1, dim
    )
    strides = (n + 1) ** np.arange(dim)[::-1]
    first = corners[(corners < n).all(axis=1)] @ strides
    steps = [np.cumsum([0, *strides[list(order)]]) for order in permutations(range(dim))]
    return SimplicialMesh(corners / n, np.concatenate([first[:, None] + step for step in steps]))


def curve(rng):
    """A closed curve in the plane, in space or beyond."""
    n, d = 40, int(rng.integers(2, 5))
    angles = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    points = np.pad(np.column_stack([np.cos(angles), np.sin(angles)]), ((0, 0), (0, d - 2)))
    return SimplicialMesh(
        turned(points, rng, 0.01), np.column_stack([np.arange(n), (np.arange(n) + 1) % n])
    )


def cloud(rng):
    """Points on a shaken sphere, or on a shaken circle in four dimensions."""
    if rng.random() < 0.5:
        return surface_cloud(rng)
    angles = 2 * np.pi * (np.arange(60) + rng.uniform(-0.3, 0.3, 60)) / 60
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros((60, 2))])
    return PointCloud(turned(points, rng, 0.005), 1)


def surface_cloud(rng):
    """Points on a shaken sphere."""
    points = rng.standard_normal((150, 3))
    return PointCloud(turned(points / np.linalg.norm(points, axis=1, keepdims=True), rng, 0.01), 2)


def graph(rng):
    """One or two rings with chords, weights over four decades."""
    ends = [
        (start + i, start + (i + 1) % 12)
        for start in (0, 12)[: rng.integers(1, 3)]
        for i in range(12)
    ]
    ends += [tuple(rng.choice(12, 2, replace=False)) for _ in range(8)]
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    upper = sp.coo_array((10 ** rng.uniform(-2, 2, len(ends)), ends.T), shape=(ends.max() + 1,) * 2)
    return sp.csr_array(upper + upper.T)


@dataclass(frozen=True)
class Row:
    """An operator, the shapes it takes, and what it promises of them."""

    name: str
    build: Callable[..., Laplacian]
    shapes: tuple[Callable, ...]
    promises: frozenset
    boundary: Callable | None = None  # of shapes with one: rows to hold at zero


def gaussian(cloud, form):
    t = neighbor_distance(cloud.points, cloud.dim) ** 2
    return gaussian_laplacian(cloud.points, 4 * t, cloud.dim, form=form)


def anisotropic(mesh):
    return anisotropic_laplacian(mesh, curvature_tensors(mesh, 5.0), "averaged")


SURFACES = (surface, slivers, soup)
MESHES = (*SURFACES, solid, curve)
LITTLE = partial(solid, sizes=(8, 3, 2, 1))
SMALL = (
    partial(surface, small=True),
    partial(slivers, small=True, thinnest=1e-4),
    soup,
    LITTLE,
    curve,
)
FLAT = DEFAULT_PROMISES | {"volume"}
MONOTONE = FLAT | {"nonnegative_weights"}
GRAPH = (DEFAULT_PROMISES - {"scaling"}) | {"nonnegative_weights"}
VECTORS = frozenset(
    {"rigid_motion", "reflection", "scaling", "union"}
)  # whose faces are all turned one way

TABLE = [
    *[
        Row(
            f"cotangent {mass}",
            partial(cotangent_laplacian, mass=mass),
            MESHES,
            FLAT,
            boundary_vertices,
        )
        for mass in ("lumped", "consistent", "averaged")
    ],
    *[
        Row(
            f"P{p}",
            partial(fem_laplacian, order=p),
            SMALL,
            FLAT,
            partial(fem_boundary_nodes, order=p),
        )
        for p in (2, 3)
    ],
    Row(
        "anisotropic",
        anisotropic,
        (surface, slivers),
        FLAT - {"orientation", "union"},
        boundary_vertices,
    ),
    Row("robust", robust_laplacian, SURFACES, MONOTONE - {"volume"}, boundary_vertices),
    Row("robust, not mollified", partial(robust_laplacian, mollify=0.0), (surface, soup), MONOTONE),
    Row(
        "robust on points",
        robust_laplacian,
        (surface_cloud,),
        DEFAULT_PROMISES | {"nonnegative_weights"},
    ),
    Row("mesh", mesh_laplacian, (surface, solid, curve), MONOTONE, boundary_vertices),
    Row(
        "mesh, random walk",
        partial(mesh_laplacian, form="random-walk"),
        (surface, solid),
        MONOTONE - {"volume"},
    ),
    Row("mesh, geodesic", partial(mesh_laplacian, distance="geodesic"), (surface,), MONOTONE),
    Row(
        "gaussian",
        partial(gaussian, form="literal"),
        (cloud,),
        DEFAULT_PROMISES - {"scaling", "union"},
    ),
    Row(
        "gaussian, random walk",
        partial(gaussian, form="random-walk"),
        (cloud,),
        DEFAULT_PROMISES - {"union"},
    ),
    Row(
        "point cloud",  # its default width depends on the volume of the whole
        point_cloud_laplacian,
        (cloud,),
        (DEFAULT_PROMISES - {"union"}) | {"nonnegative_weights"},
    ),
    Row(
        "point cloud, thesis",
        partial(point_cloud_laplacian, edge_factor=2, correct=None, form="literal"),
        (cloud,),
        DEFAULT_PROMISES | {"nonnegative_weights"},
    ),
    Row("connection", connection_laplacian, (surface,), VECTORS),
    Row(
        "connection consistent",
        partial(connection_laplacian, mass="consistent"),
        (surface,),
        VECTORS,
    ),
    Row("combinatorial", graph_laplacian, (surface, solid, curve), GRAPH, boundary_vertices),
    Row(
        "inverse length", partial(graph_laplacian, kind="weighted"), (surface, solid, curve), GRAPH
    ),
    *[
        Row(
            f"{kind} of a graph",
            partial(graph_laplacian, kind=kind),
            (graph,),
            DEFAULT_PROMISES | {"nonnegative_weights"},
        )
        for kind in ("combinatorial", "weighted", "normalized")
    ],
]
DRAWN = {TriangleMesh: surface, SimplicialMesh: solid, PointCloud: cloud, sp.sparray: graph}


def rows_of_registry(table: list[Row]) -> list[Row]:
    """Return a row for each registered operator that a table lacks."""
    there = {function_of(row.build) for row in table}
    return [
        Row(name, entry.build, tuple(DRAWN[kind] for kind in entry.shapes), DEFAULT_PROMISES)
        for name, entry in OPERATORS.items()
        if function_of(entry.build) not in there
    ]


TABLE += rows_of_registry(TABLE)
BOUNDED = {
    surface: sheet,
    SMALL[0]: sheet,
    solid: partial(solid, codimension=0),
    LITTLE: partial(LITTLE, codimension=0),
}


def judge(build, draw, promises, seed, by_points=None):
    rng = np.random.default_rng(seed)
    shape = draw(rng)
    report = check_operator(build, shape, promises=promises, by_points=by_points, rng=rng)
    assert report.passed, f"{shape}\n{report.explain()}"


def held(row, shape):
    return dirichlet_laplacian(row.build(shape), row.boundary(shape))[0]


def title(row, draw):
    """Name an operator and the kind of shapes that it is built on."""
    return f"{row.name}, {getattr(draw, 'func', draw).__name__}"


# Each kind of shape has a test of its own: none is left to chance.
FREE = [pytest.param(row, draw, id=title(row, draw)) for row in TABLE for draw in row.shapes]
HELD = [
    pytest.param(row, BOUNDED[draw], id=title(row, BOUNDED[draw]))
    for row in TABLE
    if row.boundary
    for draw in row.shapes
    if draw in BOUNDED
]
pytestmark = pytest.mark.filterwarnings("ignore:With the heat time t", "ignore:A kernel of width")


@pytest.mark.sweep
@pytest.mark.parametrize(("row", "draw"), FREE)
@few
@given(seed=seeds)
def test_a_free_operator_keeps_what_it_promises(row, draw, seed):
    judge(row.build, draw, row.promises, seed)


@pytest.mark.sweep
@pytest.mark.parametrize(("row", "draw"), HELD)
@few
@given(seed=seeds)
def test_a_held_operator_keeps_what_it_promises(row, draw, seed):
    """Hold the boundary at zero: no constants any more, and not the whole volume."""
    promises = (row.promises - {"constants", "volume"}) | {"definite"}
    judge(partial(held, row), draw, promises, seed, by_points=False)
