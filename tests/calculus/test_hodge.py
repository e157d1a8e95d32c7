import numpy as np
import pytest

from certeig.kit.arguments import require_choice
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus import hodge, one_forms
from eigenshape.calculus.derivatives import gradient
from eigenshape.calculus.hodge import decompose_field, harmonic_fields
from eigenshape.calculus.one_forms import decompose_one_form, one_form_edges
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.homology import betti_numbers
from eigenshape.geometry.measure import face_areas, face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import edge_table, submesh
from eigenshape.shapes.domains import box, disc, interval
from eigenshape.shapes.surfaces import grid, icosphere, torus


def annulus() -> TriangleMesh:
    whole = disc(8)
    far = np.linalg.norm(whole.vertices[whole.faces].mean(axis=1), axis=1) > 0.4
    return submesh(whole, far)[0]


def ring_of_tetrahedra() -> SimplicialMesh:
    whole = box(6, 6, 3)
    middles = whole.points[whole.simplices].mean(axis=1)
    inside = (np.abs(middles[:, :2] - 0.5) < 0.17).all(axis=1)
    used, renumbered = np.unique(whole.simplices[~inside], return_inverse=True)
    return SimplicialMesh(whole.points[used], renumbered.reshape(-1, 4))


def random_field(mesh: TriangleMesh) -> np.ndarray:
    field = np.random.default_rng(0).standard_normal((mesh.n_faces, 3))
    normals = face_normals(mesh)
    return field - (field * normals).sum(axis=1)[:, None] * normals


SURFACES = {"sphere": icosphere(2), "torus": torus(16, 10), "disc": disc(6), "annulus": annulus()}


@pytest.mark.parametrize("boundary", ["tangential", "normal"])
@pytest.mark.parametrize("name", SURFACES)
def test_parts_of_a_field_are_orthogonal_and_harmonic_ones_counted(name, boundary):
    mesh = SURFACES[name]
    field, areas = random_field(mesh), face_areas(mesh)
    parts = decompose_field(mesh, field, boundary=boundary)
    pieces = [parts.exact, parts.coexact, parts.harmonic]
    assert sum(pieces) == pytest.approx(field, abs=1e-12)
    products = np.einsum("afd,f,bfd->ab", pieces, areas, pieces)
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-14 * products.trace()
    basis = harmonic_fields(mesh, boundary=boundary)
    assert len(basis) == betti_numbers(mesh)[1]
    assert np.einsum("afd,f,bfd->ab", basis, areas, basis) == pytest.approx(np.eye(len(basis)))
    # The harmonic part is the projection to that basis, and nothing else.
    shares = np.einsum("afd,f,fd->a", basis, areas, field)
    assert np.tensordot(shares, basis, 1) == pytest.approx(parts.harmonic, abs=1e-12)


def test_a_gradient_is_exact_and_its_quarter_turn_is_not():
    mesh = torus(16, 10)
    values = np.random.default_rng(1).standard_normal(mesh.n_vertices)
    slopes = gradient(mesh, values)
    parts = decompose_field(mesh, slopes)
    assert parts.exact == pytest.approx(slopes, abs=1e-11)
    assert parts.potential == pytest.approx(values - values[0], abs=1e-11)
    turned = decompose_field(mesh, np.cross(face_normals(mesh), slopes))
    assert turned.coexact == pytest.approx(np.cross(face_normals(mesh), slopes), abs=1e-10)


def test_boundary_conditions_hold():
    mesh = annulus()
    rim = edge_table(mesh).n_faces == 1
    on_rim = np.unique(edge_table(mesh).edges[rim])
    free = decompose_field(mesh, random_field(mesh))
    assert (free.stream[rim] == 0).all()
    fixed = decompose_field(mesh, random_field(mesh), boundary="normal")
    assert (fixed.potential[on_rim] == 0).all()


def test_the_harmonic_field_of_an_annulus():
    mesh = annulus()
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    around = np.cross([0.0, 0.0, 1.0], middles) / (middles**2).sum(axis=1)[:, None]
    found = decompose_field(mesh, around)
    areas = face_areas(mesh)
    left = areas @ ((found.harmonic - around) ** 2).sum(axis=1)
    assert left < 0.01 * (areas @ (around**2).sum(axis=1))


SHAPES = {**SURFACES, "box": box(3, 3, 3), "ring": ring_of_tetrahedra()}


@pytest.mark.parametrize("mesh", [grid(4, 3), box(2, 3, 2)], ids=["grid", "box"])
def test_the_mass_of_a_constant_form_is_its_square_times_the_volume(mesh):
    """The form a·dx is a·(end - start) on an edge, and Whitney forms hold it exactly."""
    rng = np.random.default_rng(0)
    edges = one_form_edges(mesh)
    mass = one_forms._whitney_mass(mesh, edges)
    a, b = rng.standard_normal((2, 3))
    if mesh.dim == 2:
        a[2] = b[2] = 0  # along the grid
    starts, ends = mesh.points[edges.T]
    one, two = ((ends - starts) @ each for each in (a, b))
    assert one @ mass @ two == pytest.approx(a @ b)  # both have the volume 1


@pytest.mark.parametrize("boundary", ["tangential", "normal"])
@pytest.mark.parametrize("name", SHAPES)
def test_parts_of_a_one_form_are_orthogonal_and_harmonic_ones_counted(name, boundary):
    mesh = SHAPES[name]
    edges = one_form_edges(mesh)
    mass = one_forms._whitney_mass(mesh, edges)
    d0, d1 = one_forms._differentials(mesh, edges)
    free = np.ones(len(edges), dtype=bool)
    if boundary == "normal":
        rim = one_forms.edges_of_rows(facet_table(mesh).facets[facet_table(mesh).boundary])
        free = ~np.isin(edges @ [mesh.n_points, 1], np.sort(rim, axis=1) @ [mesh.n_points, 1])
    rng = np.random.default_rng(0)
    found = []
    for _ in range(3):
        form = rng.standard_normal(len(edges))
        parts = decompose_one_form(mesh, form, boundary=boundary)
        pieces = np.array([parts.exact, parts.coexact, parts.harmonic])
        assert pieces.sum(axis=0) == pytest.approx(form, abs=1e-12)
        products = pieces @ (mass @ pieces.T)
        assert np.abs(products - np.diag(np.diag(products))).max() < 1e-14 * products.trace()
        assert np.abs(d1 @ parts.harmonic).max() < 1e-12
        assert d0 @ parts.potential == pytest.approx(parts.exact)
        turning = d1.T @ parts.stream
        assert (mass @ parts.coexact)[free] == pytest.approx(turning[free], abs=1e-6)
        found.append(parts.harmonic)
    numbers = betti_numbers(mesh)
    # By Lefschetz duality forms that vanish on the boundary see the other cycles.
    dimension = numbers[1] if boundary == "tangential" or mesh.dim == 2 else numbers[2]
    sizes = np.linalg.svd(np.array(found), compute_uv=False)
    assert int((sizes > 1e-10).sum()) == dimension


def test_a_moebius_band_has_no_harmonic_form_that_stands_on_its_boundary():
    n = 24
    number, other = np.arange(n), (np.arange(n) + 1) % n
    angles = 2 * np.pi * number / n
    middles = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    across = np.cos(angles / 2)[:, None] * middles + np.outer(np.sin(angles / 2), [0, 0, 1])
    one, two = number, number + n
    # At the seam the two sides change places.
    one_after, two_after = np.where(other > 0, (one[other], two[other]), (two[other], one[other]))
    faces = np.concatenate(
        [np.column_stack([one, one_after, two]), np.column_stack([two, one_after, two_after])]
    )
    band = SimplicialMesh(np.concatenate([middles - 0.3 * across, middles + 0.3 * across]), faces)
    form = np.random.default_rng(0).standard_normal(len(one_form_edges(band)))
    sizes = [
        np.abs(decompose_one_form(band, form, boundary=boundary).harmonic).max()
        for boundary in ("tangential", "normal")
    ]
    assert sizes[0] > 0.01
    assert sizes[1] < 1e-10


def test_edges_are_those_of_the_edge_table():
    mesh = torus(8, 6)
    assert (one_form_edges(mesh) == edge_table(mesh).edges).all()


def test_bad_input_is_named(monkeypatch):
    ball = icosphere(1)
    field = random_field(ball)
    with pytest.raises(InvalidParameterError, match="vectors must hold one vector per face"):
        decompose_field(ball, field[1:])
    with pytest.raises(InvalidParameterError, match="vectors must be tangent to their faces"):
        decompose_field(ball, field + np.eye(3)[2])
    with pytest.raises(InvalidParameterError, match="vectors must be finite; that of face 2"):
        decompose_field(ball, np.where(np.arange(80)[:, None] == 2, np.nan, field))
    with pytest.raises(InvalidParameterError, match="boundary must be 'tangential' or 'normal'"):
        require_choice("free", hodge.Rim, "boundary")
    with pytest.raises(InvalidParameterError, match="values must hold one number per edge"):
        decompose_one_form(ball, [1.0])
    with pytest.raises(InvalidParameterError, match="values must be finite; that of edge 0"):
        decompose_one_form(ball, np.full(120, np.inf))
    with pytest.raises(InvalidShapeError, match="One-forms need triangles"):
        decompose_one_form(interval(4), np.ones(4))
    faces = ball.faces.copy()
    faces[3] = faces[3, ::-1]
    with pytest.raises(InvalidShapeError, match="turned against each other"):
        decompose_field(TriangleMesh(ball.vertices, faces), field)
    monkeypatch.setattr(one_forms, "ROUNDS", 1)
    with pytest.raises(ConvergenceError, match="closed part of a one-form"):
        decompose_one_form(grid(2, 2), np.arange(16.0))
