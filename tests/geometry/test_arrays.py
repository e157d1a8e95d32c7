import subprocess
import sys

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from certeig.kit.arrays import finite_values, positive_values, whole_number, whole_numbers
from certeig.kit.errors import InvalidParameterError
from eigenshape._arrays import label_components, step_number, vertex_values
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh


def test_whole_numbers_of_any_type_become_ints():
    assert type(whole_number(np.int8(5), "k", 1, 5)) is int


@pytest.mark.parametrize("value", [np.array([1, 2]), np.array(1.5)])
def test_what_is_no_whole_number_is_refused(value):
    with pytest.raises(InvalidParameterError, match=r"k must be a whole number; it is array\("):
        whole_number(value, "k", 1, 5)


@pytest.mark.parametrize("value", [0, 6])
def test_whole_numbers_out_of_range_are_refused(value):
    with pytest.raises(InvalidParameterError, match=rf"k must lie in 1\.\.5; it is {value}"):
        whole_number(value, "k", 1, 5)


def test_positive_values_name_the_first_that_is_not():
    assert positive_values([1, 2], "times").tolist() == [1.0, 2.0]
    with pytest.raises(
        InvalidParameterError, match=r"times must be positive and finite; entry 1 is -2\.0"
    ):
        positive_values([1, -2, -3], "times")
    with pytest.raises(
        InvalidParameterError, match=r"times must be a list of numbers; the shape is \(1, 2\)"
    ):
        positive_values([[1, 2]], "times")


def test_vertex_values_are_one_finite_number_a_vertex():
    assert vertex_values([1, 2], "field", 2).dtype == np.float64
    with pytest.raises(
        InvalidParameterError,
        match=r"field must hold one number per vertex, shape \(3,\); the shape is",
    ):
        vertex_values([1, 2], "field", 3)
    with pytest.raises(InvalidParameterError, match="field must be finite; entry 1 is nan"):
        vertex_values([1, np.nan], "field", 2)


def test_a_bound_with_a_reason_is_named_with_it():
    assert step_number(np.int16(3)) == 3
    with pytest.raises(InvalidParameterError, match="n_steps must be at least 1; it is 0"):
        step_number(0)
    message = "n_steps must be at most 1000000, because no shape needs more steps; it is 1000001"
    with pytest.raises(InvalidParameterError, match=message):
        step_number(1_000_001)


@pytest.mark.parametrize(
    ("value", "fact"),
    [
        (["1.5"], "must be real numbers; the type is <U3"),
        ([1j], "must be real numbers; the type is complex128"),
        ([None], "must be real numbers; the type is object"),
        ([[1.0], [1.0, 2.0]], "must be a list of numbers; its entries differ in length"),
    ],
)
def test_what_is_no_number_is_refused(value, fact):
    with pytest.raises(InvalidParameterError, match=f"times {fact}"):
        positive_values(value, "times")
    with pytest.raises(InvalidParameterError, match=f"field {fact}"):
        vertex_values(value, "field", 1)


POINTS = np.vstack([np.eye(3), np.zeros(3)])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
MASKED_POINTS = np.ma.masked_array(POINTS, mask=np.zeros_like(POINTS))
MASKED_POINTS[2, 1] = np.ma.masked
MASKED_FACES = np.ma.masked_array(FACES, mask=FACES == 3)


@pytest.mark.parametrize(
    ("make", "fact"),
    [
        (
            lambda: TriangleMesh(MASKED_POINTS, FACES),
            r"vertices must not be masked; entry \(2, 1\) is \(1 such\)",
        ),
        (
            lambda: TriangleMesh(list(MASKED_POINTS), FACES),
            r"vertices must not be masked; entry \(2, 1\) is",
        ),
        (
            lambda: TriangleMesh(POINTS, MASKED_FACES),
            r"faces must not be masked; entry \(1, 2\) is",
        ),
        (
            lambda: SimplicialMesh(MASKED_POINTS, FACES),
            r"points must not be masked; entry \(2, 1\) is",
        ),
        (
            lambda: SimplicialMesh(POINTS, MASKED_FACES),
            r"simplices must not be masked; entry \(1, 2\) is",
        ),
        (lambda: PointCloud(MASKED_POINTS), r"points must not be masked; entry \(2, 1\) is"),
    ],
)
def test_masked_entries_of_shapes_are_refused(make, fact):
    with pytest.raises(InvalidShapeError, match=fact):
        make()


@pytest.mark.parametrize(
    "door",
    [
        lambda values: positive_values(values, "times"),
        lambda values: finite_values(values, "times"),
        lambda values: vertex_values(values, "times", 4),
        lambda values: whole_numbers(values, "times", 0, 9),
    ],
)
def test_masked_entries_of_values_are_refused(door):
    values = np.ma.masked_array([1, 2, 3, 4], mask=[0, 0, 1, 1])
    with pytest.raises(
        InvalidParameterError, match=r"times must not be masked; entry 2 is \(2 such\)"
    ):
        door(values)
    values.mask = False
    np.testing.assert_array_equal(door(values), [1, 2, 3, 4])


def test_a_masked_array_without_a_masked_entry_is_an_array():
    mesh = TriangleMesh(np.ma.masked_array(POINTS), np.ma.masked_array(FACES))
    assert type(mesh.vertices) is type(mesh.faces) is np.ndarray
    np.testing.assert_array_equal(mesh.vertices, POINTS)


BOMBS = {
    "vertices": "TriangleMesh(np.broadcast_to([0.0, 1, 2], (2**28, 3)), [[0, 1, 2]])",
    "faces": "TriangleMesh(np.eye(3), np.broadcast_to([0, 1, 2], (2**28, 3)))",
    "points": "PointCloud(np.broadcast_to(0.0, (2**28, 3)))",
    "values": "merge_tree(icosphere(0), np.broadcast_to(0.0, 2**40))",
}


@pytest.mark.long
@pytest.mark.parametrize("name", BOMBS)
def test_an_array_that_memory_cannot_hold_is_refused_before_it_is_copied(name):
    script = f"""
import resource, sys
import numpy as np
from eigenshape import *
resource.setrlimit(resource.RLIMIT_DATA, (2**30,) * 2)
try:
    {BOMBS[name]}
except EigenshapeError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith(f"{name} must ")


def test_an_array_is_measured_against_the_memory(monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 2.0**10)
    fact = r"points must fit into 50 % of the memory, 0\.0 GiB; for checking and copying an array of shape \(20, 2\) "
    with pytest.raises(InvalidShapeError, match=fact):
        PointCloud(np.arange(40.0).reshape(20, 2))


def test_one_row_that_is_broadcast_is_no_shape():
    row = np.broadcast_to([0.0, 1.0, 2.0], (5, 3))
    fact = r"not be one broadcast row; all 5 rows are \[0\.0, 1\.0, 2\.0\] at one place in memory"
    with pytest.raises(InvalidShapeError, match=fact):
        PointCloud(row)
    assert PointCloud(np.array(row)).n_points == 5
    assert PointCloud(row[:1]).n_points == 1


def test_groups_are_those_of_scipy_in_the_order_of_their_first_things():
    rng = np.random.default_rng(3)
    for n_links in (0, 30, 60, 200):
        one, two = rng.integers(0, 80, size=(2, n_links))
        graph = sp.coo_array((np.ones(n_links), (one, two)), shape=(80, 80))
        wanted, groups = connected_components(graph, directed=False)
        count, labels = label_components(80, one, two)
        assert count == wanted
        assert (labels == groups).all()
        assert (np.diff(np.unique(labels, return_index=True)[1]) > 0).all()
