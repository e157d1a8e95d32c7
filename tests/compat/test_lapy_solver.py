"""Our solver beside LaPy's, on the same meshes."""

import lapy
import numpy as np
import pytest

import eigenshape as es
from eigenshape.compat.lapy import Solver


def bumpy() -> lapy.TriaMesh:
    ball = es.icosphere(2)
    x, y, z = ball.vertices.T
    radius = 1 + 0.3 * x * y + 0.2 * z**3 + 0.1 * np.sin(3 * x + y)
    return lapy.TriaMesh(ball.vertices * [1.0, 1.3, 0.8] * radius[:, None], ball.faces.copy())


def sheet() -> lapy.TriaMesh:
    grid = es.shapes.grid(8, 6)
    return lapy.TriaMesh(grid.vertices.copy(), grid.faces.copy())


def solid() -> lapy.TetMesh:
    box = es.shapes.box(3, 4, 3)
    return lapy.TetMesh(box.points * [1.0, 1.2, 0.7], box.simplices.copy())


CASES = {
    "triangles": (bumpy, {}),
    "lumped": (bumpy, {"lump": True}),
    "boundary": (sheet, {}),
    "anisotropic": (bumpy, {"aniso": 2.0}),
    "two numbers": (bumpy, {"aniso": (0.5, 3.0), "aniso_smooth": 3, "lump": True}),
    "tetrahedra": (solid, {}),
    "lumped tetrahedra": (solid, {"lump": True, "aniso": 1.0}),
    "single": (bumpy, {"dtype": np.float32}),
}


@pytest.mark.parametrize("case", CASES)
def test_matrices_and_eigenpairs_are_those_of_lapy(case):
    make, options = CASES[case]
    theirs, ours = lapy.Solver(make(), **options), Solver(make(), **options)
    single = options.get("dtype") is np.float32
    rounding = 1e-6 if single else 1e-12
    for name in ("stiffness", "mass"):
        one, two = getattr(theirs, name), getattr(ours, name)
        assert (type(two), two.dtype) == (type(one), one.dtype)
        assert abs(one - two).max() <= rounding * abs(one).max()
    assert ours.geotype is theirs.geotype
    expected, _ = theirs.eigs(8)
    values, vectors = ours.eigs(8)
    assert values.dtype == vectors.dtype == theirs.stiffness.dtype
    np.testing.assert_allclose(values, expected, rtol=rounding, atol=10 * rounding * expected[-1])
    gram = vectors.T @ (ours.mass @ vectors)
    np.testing.assert_allclose(gram, np.eye(8), atol=10 * rounding)


def test_a_program_may_change_what_it_gets():
    solver = Solver(bumpy(), lump=True)
    solver.mass.data *= 4.0
    values, vectors = solver.eigs(3)
    vectors[:, 0] = 0.0
    np.testing.assert_allclose(4 * values, Solver(bumpy(), lump=True).eigs(3)[0], atol=1e-12)


def test_its_text_makes_no_matrix():
    class Lazy(Solver):
        def __init__(self):
            pass

        @property
        def stiffness(self):
            raise AssertionError

    assert repr(Solver(bumpy())) == "Solver(162 points)"
    assert repr(Lazy()) == "Lazy()"


def test_mass_alone():
    for lump in (False, True):
        difference = Solver.fem_tria_mass(bumpy(), lump) - lapy.Solver.fem_tria_mass(bumpy(), lump)
        assert abs(difference).max() < 1e-15
    assert Solver.fem_tria_mass(bumpy(), dtype=np.float32).dtype == np.float32


@pytest.mark.parametrize(
    "options",
    [{"sigma": 5.0, "rng": 0}, {"sigma": 5.0, "v0": np.ones(162)}, {"mode": "cayley", "rng": 0}],
)
def test_other_eigenvalues_are_those_that_lapy_finds(options):
    theirs, ours = (
        kind(bumpy()).eigs(5, **options | {"sigma": options.get("sigma", -1.0)})
        for kind in (lapy.Solver, Solver)
    )
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-9, atol=1e-9)
    assert ours[1].shape == theirs[1].shape


@pytest.mark.parametrize("integrate", [True, False])
@pytest.mark.parametrize("columns", [None, 1, 3])
def test_poisson_with_values_and_fluxes(integrate, columns):
    rng = np.random.default_rng(0)
    h = rng.normal(size=63 if columns is None else (63, columns))
    given = {
        "dtup": (np.array([5, 0, 40]), np.array([1.0, -2.0, 0.5])),
        "ntup": (np.array([7, 8]), np.array([0.3, -0.1])),
        "integrate": integrate,
    }
    theirs, ours = (kind(sheet()).poisson(h, **given) for kind in (lapy.Solver, Solver))
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max())


def test_poisson_of_a_number():
    theirs, ours = (
        kind(sheet()).poisson(1.0, ([0], [2.0]), integrate=True) for kind in (lapy.Solver, Solver)
    )
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max())


def test_poisson_without_values_takes_means_out_of_both_sides():
    solver = Solver(bumpy())
    h = bumpy().v[:, 1]
    found = solver.poisson(h + 5.0)
    ones = np.ones(len(h))
    assert abs(ones @ (solver.mass @ found)) < 1e-12
    mean = ones @ (solver.mass @ h) / solver.mass.sum()
    np.testing.assert_allclose(solver.stiffness @ found, solver.mass @ (h - mean), atol=1e-12)


def test_poisson_in_single_precision():
    found = Solver(bumpy(), dtype=np.float32).poisson(bumpy().v[:, 1])
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, Solver(bumpy()).poisson(bumpy().v[:, 1]), atol=1e-5)


def test_what_is_no_mesh_of_lapy_is_named():
    with pytest.raises(es.InvalidParameterError, match=r"TetMesh, with vertices v .*Polygon"):
        Solver(lapy.Polygon(np.eye(3)))


def test_three_numbers_of_anisotropy():
    with pytest.raises(ValueError, match=r"aniso must be one number or two; its shape is \(3,\)"):
        Solver(bumpy(), aniso=(1.0, 2.0, 3.0))


def test_a_triangle_without_area_is_refused():
    flat = lapy.TriaMesh(
        np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.0]]), [[0, 1, 2], [0, 1, 3]]
    )
    with pytest.raises(es.InvalidShapeError, match="face 0"):
        Solver(flat)
