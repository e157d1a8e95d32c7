from dataclasses import FrozenInstanceError
from inspect import unwrap

import numpy as np
import pytest
from intervals import assert_around, finer
from pencils import TETRAHEDRON

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.facets import boundary_facets
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import interpolation_constants
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian
from eigenshape.shapes import exact
from eigenshape.shapes.domains import ball, box, circle, disc, interval, irregular_grid
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.solve import solve_spectrum


def flat_torus(n):
    """Return the product of two n-gons in R⁴, which is flat, and its period."""
    mesh, (i, j) = torus(n, n), np.divmod(np.arange(n * n), n)
    turns = 2 * np.pi / n * np.column_stack([i, j])
    points = np.column_stack([np.cos(turns), np.sin(turns)])
    return SimplicialMesh(points, mesh.faces), 2 * n * np.sin(np.pi / n)


def with_cut_corners(square):
    """Turn the diagonal of each corner cell that leaves its corner to one face, which both sheets would share."""
    faces = square.faces.copy()
    for corner in np.flatnonzero(np.bincount(faces.ravel()) == 1):
        (one,) = np.flatnonzero((faces == corner).any(axis=1))
        place = int(np.flatnonzero(faces[one] == corner)[0])
        _, left, right = np.roll(faces[one], -place)
        both = np.isin(faces, [left, right]).sum(axis=1) == 2
        both[one] = False
        (two,) = np.flatnonzero(both)
        (inner,) = np.setdiff1d(faces[two], [left, right])
        faces[one], faces[two] = (corner, left, inner), (corner, inner, right)
    return TriangleMesh(square.vertices, faces)


def pillow(n):
    """Return two squares sewn along their rims: what is even across is Neumann's, what is odd Dirichlet's."""
    front = with_cut_corners(grid(n, n))
    rim = ((front.vertices == 0) | (front.vertices == 1))[:, :2].any(axis=1)
    names = np.where(rim, np.arange(len(rim)), len(rim) + np.arange(len(rim)))
    back = names[front.faces[:, ::-1]]
    used, faces = np.unique(np.concatenate([front.faces, back]), return_inverse=True)
    return TriangleMesh(front.vertices[used % len(rim)], faces.reshape(-1, 3))


@pytest.mark.long
@pytest.mark.parametrize("condition", ["neumann", "dirichlet"])
@pytest.mark.parametrize(
    ("mesh", "sides"),
    [
        (grid(20, 15, width=2.0), (2.0, 1.0)),
        (irregular_grid(18, 18, rng=np.random.default_rng(3)), (1.0, 1.0)),
        (box(7, 7, 6, sides=(1.0, 1.2, 0.7)), (1.0, 1.2, 0.7)),
        (interval(150, 3.0), [3.0]),
    ],
)
def test_a_hundred_eigenvalues_of_boxes(mesh, sides, condition):
    found = bracket_eigenvalues(mesh, 100, boundary=condition)
    assert_around(found, exact.box_eigenvalues(100, sides, condition))


def test_a_hundred_eigenvalues_of_a_flat_torus_in_four_dimensions():
    mesh, period = flat_torus(20)
    assert_around(
        bracket_eigenvalues(mesh, 100), exact.flat_torus_eigenvalues(100, period * np.eye(2))
    )


def test_a_hundred_eigenvalues_of_a_tetrahedron():
    # Around each of its vertices lie 180°: it is a flat torus with opposite points made one, which keep every cosine.
    edge = 8**0.5
    known = exact.flat_torus_eigenvalues(200, [[2 * edge, 0], [edge, edge * 3**0.5]])[
        np.r_[0, 1:199:2]
    ]
    assert_around(bracket_eigenvalues(finer(TETRAHEDRON, 3), 100), known)


def test_a_hundred_eigenvalues_of_a_pillow():
    parts = [
        exact.box_eigenvalues(100, (1, 1), condition) for condition in ("neumann", "dirichlet")
    ]
    assert_around(bracket_eigenvalues(pillow(12), 100), np.sort(np.concatenate(parts))[:100])


@pytest.mark.parametrize("n", [3, 40])
def test_a_polygon_is_a_circle_of_its_length(n):
    length = 2 * n * np.sin(np.pi / n)
    known = (2 * np.pi / length * np.repeat(np.arange(n), 2)[1 : n + 1]) ** 2
    assert_around(bracket_eigenvalues(circle(n), n), known)


def refined_truth(mesh, k, times, condition="neumann"):
    """Return eigenvalues of cubic elements on finer and finer meshes, and how far the last step moved them."""
    steps = []
    for level in (times - 1, times):
        fine = finer(mesh, level)
        laplacian = fem_laplacian(fine, 3)
        nodes = fem_boundary_nodes(fine, 3)
        steps.append(
            solve_spectrum(laplacian, k)
            if condition == "neumann"
            else solve_spectrum(laplacian, k, fixed=nodes)
        )
    return steps[1].eigenvalues.copy(), np.abs(steps[1].eigenvalues - steps[0].eigenvalues)


def cube(n):
    """Return the skin of a cube."""
    solid = box(n, n, n)
    used, faces = np.unique(boundary_facets(solid), return_inverse=True)
    return TriangleMesh(solid.points[used], faces.reshape(-1, 3))


@pytest.mark.long
@pytest.mark.parametrize(
    ("mesh", "bracketed", "refined", "condition"),
    [
        (cube(2), 3, 3, "neumann"),
        (icosphere(1), 2, 3, "neumann"),
        (disc(2), 3, 3, "neumann"),
        (disc(2), 3, 3, "dirichlet"),
    ],
)
def test_a_hundred_eigenvalues_of_polyhedra(mesh, bracketed, refined, condition):
    known, moved = refined_truth(mesh, 100, refined, condition)
    found = bracket_eigenvalues(finer(mesh, bracketed), 100, boundary=condition)
    known[: found.n_zero] = 0
    assert_around(found, known)
    widths = found.upper - found.lower
    assert (moved[1:] < 0.01 * widths[1:]).all()
    inside = np.minimum(known - found.lower, found.upper - known)[1:]
    assert (inside > 10 * moved[1:]).all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("mesh", "condition"),
    [(grid(4, 4), "neumann"), (grid(4, 4), "dirichlet"), (cube(2), "neumann")],
)
def test_the_width_falls_with_the_square_of_the_edges(mesh, condition):
    brackets = [
        bracket_eigenvalues(finer(mesh, times), 9, boundary=condition) for times in (2, 3, 4)
    ]
    first = brackets[0].n_zero
    widths = np.array([found.upper - found.lower for found in brackets])[:, first:]
    orders = -np.polyfit(np.arange(3) * np.log(2), np.log(widths), 1)[0]
    assert ((orders > 1.9) & (orders < 2.1)).all()


@pytest.mark.parametrize(
    "mesh", [icosphere(1), irregular_grid(8, 8, rng=np.random.default_rng(0)), ball(4), circle(40)]
)
@pytest.mark.parametrize("scale", [1e-100, 0.125, 1e100])
def test_units_scale(mesh, scale):
    found = bracket_eigenvalues(mesh, 20)
    scaled = bracket_eigenvalues(SimplicialMesh(scale * mesh.points, mesh.simplices), 20)
    for end in ("lower", "upper"):
        np.testing.assert_allclose(getattr(scaled, end) * scale**2, getattr(found, end), rtol=1e-9)
    assert scaled.longest_edge == pytest.approx(scale * found.longest_edge)
    assert scaled.constant == pytest.approx(scale * found.constant)
    assert scaled.n_zero == found.n_zero == 1


def test_names_and_turns_change_nothing():
    mesh, rng = irregular_grid(10, 10, rng=np.random.default_rng(5)), np.random.default_rng(6)
    names, turn = rng.permutation(mesh.n_vertices), np.linalg.qr(rng.standard_normal((3, 3)))[0]
    points = np.empty_like(mesh.vertices)
    points[names] = mesh.vertices @ turn + [3, 1, 2]
    faces = rng.permutation(names[mesh.faces])[:, [1, 0, 2]]
    one, two = (bracket_eigenvalues(shape, 30) for shape in (mesh, TriangleMesh(points, faces)))
    np.testing.assert_allclose(one.lower, two.lower, rtol=1e-9)
    np.testing.assert_allclose(one.upper, two.upper, rtol=1e-9)


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_values_are_kept_and_explained():
    found = bracket_eigenvalues(grid(8, 8), 5)
    assert found.longest_edge == pytest.approx(2**0.5 / 8)
    assert (
        found.constant
        == interpolation_constants(grid(8, 8)).max()
        == pytest.approx(0.1893 * found.longest_edge)
    )
    assert not found.lower.flags.writeable
    assert not found.upper.flags.writeable
    with pytest.raises(FrozenInstanceError):
        found.n_zero = 0
    text = found.explain()
    assert "Each of the 5 lowest eigenvalues" in text
    assert "0.1893 of the longest edge" in text
    assert "The first is 0. The brackets are" in text
    assert (
        "The first 2 are 0."
        in bracket_eigenvalues(disjoint_union(grid(1, 1), grid(1, 1)), 2).explain()
    )
    assert (
        "of their upper ends wide"
        in bracket_eigenvalues(grid(8, 8), 3, boundary="dirichlet").explain()
    )


@pytest.mark.parametrize("k", [0, 26])
def test_more_than_there_are_points_are_refused(k):
    with pytest.raises(InvalidParameterError, match=rf"k must lie in 1\.\.25; it is {k}"):
        bracket_eigenvalues(grid(4, 4), k)


def test_more_than_there_are_free_points_are_refused():
    with pytest.raises(InvalidParameterError, match=r"k must lie in 1\.\.9; it is 10"):
        bracket_eigenvalues(grid(4, 4), 10, boundary="dirichlet")


@pytest.mark.parametrize(
    ("mesh", "n", "inside"),
    [(icosphere(1), 0, 42), (grid(1, 1), 4, 0), (TETRAHEDRON, 0, 4), (interval(1), 2, 0)],
)
def test_a_condition_needs_a_boundary_and_points_inside(mesh, n, inside):
    with pytest.raises(
        InvalidParameterError,
        match=rf"needs a boundary and points inside; .* has {n} points on its boundary and {inside}",
    ):
        bracket_eigenvalues(mesh, 1, boundary="dirichlet")


def test_other_conditions_are_refused():
    with pytest.raises(
        InvalidParameterError, match="boundary must be 'neumann' or 'dirichlet'; it is 'robin'"
    ):
        unwrap(bracket_eigenvalues)(grid(2, 2), 1, boundary="robin")


def test_flat_faces_and_loose_vertices_are_refused():
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 3], [0, 1, 2]])
    with pytest.raises(InvalidShapeError, match=r"Faces must have area; face 1 is \[0, 1, 2\]"):
        bracket_eigenvalues(flat, 1)
    with pytest.raises(InvalidShapeError, match="Every vertex must belong to a face; vertex 3"):
        bracket_eigenvalues(TriangleMesh([*grid(1, 1).vertices[:3], [9, 9, 9]], [[0, 1, 2]]), 1)


def test_slivers_in_which_rounding_leaves_nothing():
    """Of edges of one and a hundred million, no digit of a lower bound is sure."""
    mesh = TriangleMesh(grid(4, 4).vertices * [1e8, 1.0, 1.0], grid(4, 4).faces)
    brackets = bracket_eigenvalues(mesh, 5)
    assert brackets.lower.tolist() == [0.0] * 5
    assert not np.signbit(brackets.lower).any()
    assert (brackets.upper >= [0, *(np.pi / 1e8 * np.arange(1, 5)) ** 2]).all(), (
        "an interval's, with Neumann's condition"
    )
    assert "Rounding in slivers leaves no lower bound above 0" in brackets.explain()


@pytest.mark.data
def test_a_pillow_with_slivers(data):
    mesh = read_mesh(data / "nasty" / "own" / "sliver_pillow.off")
    brackets = bracket_eigenvalues(mesh, 10)
    values = solve_spectrum(cotangent_laplacian(mesh, "consistent"), 10).eigenvalues
    assert (brackets.lower == 0).all()
    assert brackets.upper[0] == 0, "the constant function's; the solver finds it but for rounding"
    assert (brackets.upper[1:] >= values[1:]).all()
