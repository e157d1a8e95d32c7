import numpy as np
import pytest
import scipy.sparse as sp

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.operators.catalog import OPERATORS, build_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.robust import robust_laplacian
from eigenshape.shapes.domains import box, interval
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere

SHAPES = {
    "triangles": icosphere(2),
    "tetrahedra": box(4, 4, 4),
    "curve": interval(60),
    "points": PointCloud(icosphere(2).vertices),
    "graph": sp.csr_array(np.ones((5, 5)) - np.eye(5)),
}


def test_options_are_the_arguments_after_the_shape_that_an_entry_does_not_fix():
    assert OPERATORS["mesh"].options[:3] == ("t", "h", "edge_factor")
    assert OPERATORS["robust"].options == ("mollify", "n_neighbors")
    assert OPERATORS["p3"].options == ()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", OPERATORS)
@pytest.mark.filterwarnings("ignore:With the heat time")
def test_each_takes_what_it_says_and_refuses_the_rest(shape, name):
    takes = isinstance(SHAPES[shape], OPERATORS[name].shapes)
    if takes:
        laplacian = build_laplacian(SHAPES[shape], name)
        ones = np.ones(laplacian.n_points)
        assert np.abs(laplacian.stiffness @ ones).max() < 1e-11 * laplacian.stiffness.max()
    else:
        with pytest.raises(
            InvalidParameterError,
            match=rf"The {name} operator takes .*; the shape is a .* It is for",
        ):
            build_laplacian(SHAPES[shape], name)


def test_without_a_name_the_shape_decides():
    one, two = build_laplacian(SHAPES["tetrahedra"]), cotangent_laplacian(SHAPES["tetrahedra"])
    assert (one.stiffness != two.stiffness).nnz == 0
    assert build_laplacian(SHAPES["points"]).kernel is not None
    assert build_laplacian(SHAPES["graph"]).n_points == 5


def test_clouds_have_the_robust_operator_by_name():
    named = build_laplacian(SHAPES["points"], "robust", n_neighbors=12)
    direct = robust_laplacian(SHAPES["points"], n_neighbors=12)
    assert (named.stiffness != direct.stiffness).nnz == 0


def test_unknown_names_and_options_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"operator must be one of cotangent, p2, .*; it is 'heat'"
    ):
        build_laplacian(SHAPES["triangles"], "heat")
    with pytest.raises(
        InvalidParameterError, match="The cotangent operator takes mass, conductivity; the option t"
    ):
        build_laplacian(SHAPES["triangles"], "cotangent", t=1.0)
    with pytest.raises(
        InvalidParameterError, match="The p2 operator takes no options; the option mass was given"
    ):
        build_laplacian(SHAPES["triangles"], "p2", mass="lumped")


def test_uneven_points_get_the_robust_operator():
    ball = fibonacci_sphere(300).vertices
    far = np.array([[60.0, 1, 0], [60.0, -1, 0], [60.0, 0, 1]])
    cloud = PointCloud(np.concatenate([ball, far]))
    with pytest.warns(UserWarning, match="too uneven for a kernel of one width"):
        found = build_laplacian(cloud)
    wanted = robust_laplacian(cloud)
    assert abs(found.stiffness - wanted.stiffness).max() == 0
    for named in ({"operator": "point-cloud"}, {"t": 0.2}):  # what is asked for is not replaced
        with pytest.raises(InvalidShapeError, match="Choose a larger t"):
            build_laplacian(cloud, **named)
    assert build_laplacian(PointCloud(ball)).kernel is not None


def test_uneven_points_off_a_surface_are_refused():
    line = np.concatenate([np.linspace(0, 1, 50), [60.0, 61.0]])[:, None]
    with pytest.raises(InvalidShapeError, match="Choose a larger t"):
        build_laplacian(PointCloud(line, dim=1))


def tube():
    """A grid that is rolled up and left open, as files with textures are."""
    sheet = es.shapes.grid(12, 8)
    angles = 2 * np.pi * sheet.vertices[:, 0] / sheet.vertices[:, 0].max()
    rolled = np.column_stack([np.cos(angles), np.sin(angles), sheet.vertices[:, 1]])
    return es.TriangleMesh(rolled, sheet.faces)


@pytest.mark.parametrize("name", ["cotangent", "robust", "p2", "p3"])
def test_an_open_seam_is_said_where_the_operator_is_built(name):
    with pytest.warns(UserWarning, match=r"a seam must share their vertices.*\(8 such\)"):
        opened = es.build_laplacian(tube(), name)
    closed = es.build_laplacian(es.repair(tube(), ["weld_seams"]).mesh, name)
    first = es.solve_spectrum(closed, 4).eigenvalues[1]
    assert es.solve_spectrum(opened, 4).eigenvalues[1] != pytest.approx(first, rel=0.05)
