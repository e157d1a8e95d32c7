"""Diagrams beside GUDHI's extended persistence."""

import gudhi
import numpy as np
import pytest

import eigenshape as es
from eigenshape.geometry.topology import submesh


def some_faces(mesh, share):
    return submesh(mesh, np.random.default_rng(1).random(mesh.n_faces) < share)[0]


def random_simplices(corners, count):
    rng = np.random.default_rng(corners)
    return es.SimplicialMesh(
        rng.random((12, 3)), [rng.choice(12, corners, replace=False) for _ in range(count)]
    )


SHAPES = {
    "sphere": es.icosphere(1),
    "torus": es.shapes.torus(7, 5),
    "flat": es.shapes.grid(6, 5),
    "pieces": es.geometry.disjoint_union(
        es.shapes.torus(6, 4), es.shapes.torus(5, 4), es.shapes.grid(3, 3)
    ),
    "holes": some_faces(es.shapes.torus(12, 9), 0.8),
    "bow-ties": some_faces(es.shapes.grid(9, 8), 0.7),
    "projective plane": es.shapes.projective_plane(1),
    "curves": random_simplices(2, 20),
    "solids": random_simplices(4, 8),
    "soup": random_simplices(3, 25),
}


def by_gudhi(shape, values):
    simplices = gudhi.SimplexTree()
    for simplex in shape.simplices.tolist():
        simplices.insert(simplex)
    for vertex, value in enumerate(values.tolist()):
        simplices.insert([vertex], value)
        simplices.assign_filtration([vertex], value)
    simplices.make_filtration_non_decreasing()
    simplices.extend_filtration()
    ordinary, relative, upward, downward = simplices.extended_persistence(
        homology_coeff_field=2, min_persistence=-1
    )
    return {
        "minima": of_dimension(0, ordinary),
        "maxima": of_dimension(1, relative),
        "components": of_dimension(0, upward + downward),
        "loops": of_dimension(1, upward + downward),
    }


def of_dimension(dimension, found):
    return apart([pair for dim, pair in found if dim == dimension])


def apart(pairs):
    """Sort the pairs that do not end where they begin: GUDHI moves values into [1, 2] and back, which rounds."""
    array = np.array(sorted(pairs), dtype=float).reshape(-1, 2)
    return array[np.abs(array[:, 0] - array[:, 1]) > 1e-9]


def ours(pairs):
    return apart(zip(pairs.births.tolist(), pairs.deaths.tolist(), strict=True))


@pytest.mark.parametrize("spread", [2, 6, 10**6])
@pytest.mark.parametrize("name", SHAPES)
def test_every_kind_of_pair_is_that_of_extended_persistence(name, spread):
    shape = SHAPES[name]
    for seed in range(5):
        values = np.random.default_rng(seed).integers(0, spread, shape.n_points) / spread
        expected, found = by_gudhi(shape, values), es.features.persistence_diagram(shape, values)
        for kind in ("minima", "maxima", "components", "loops"):
            pairs = getattr(found, kind)
            if pairs is not None:
                np.testing.assert_allclose(
                    ours(pairs), expected[kind], atol=1e-9, err_msg=f"{kind}, seed {seed}"
                )


def test_which_shapes_have_loops():
    kinds = {
        name: es.features.persistence_diagram(shape, np.arange(shape.n_points) * 1.0)
        for name, shape in SHAPES.items()
    }
    counts = {
        name: None if found.loops is None else len(found.loops.births)
        for name, found in kinds.items()
    }
    assert counts["sphere"] == counts["flat"] == 0
    assert counts["torus"] == 2
    assert counts["pieces"] == 4
    assert counts["projective plane"] == 1
    assert counts["solids"] is None
    assert counts["soup"] is None
    assert counts["holes"] > 5
    curves = SHAPES["curves"]
    n_edges, n_pieces = (
        es.operators.edge_graph(curves).nnz // 2,
        es.geometry.vertex_components(curves)[0],
    )
    assert counts["curves"] == n_edges - 12 + n_pieces > 5


@pytest.mark.data
@pytest.mark.parametrize(
    "path", ["classics/fertility.off", "classics/3holes.off", "retrieval/cup/psb22.ply"]
)
def test_real_surfaces(data, path):
    mesh = es.read_mesh(data / path)
    values = mesh.vertices[:, 1]
    expected, found = by_gudhi(mesh, values), es.features.persistence_diagram(mesh, values)
    size = np.ptp(values)
    for kind in ("minima", "maxima", "components", "loops"):
        theirs, pairs = expected[kind], ours(getattr(found, kind))
        lasting = [some[np.abs(some[:, 0] - some[:, 1]) > 1e-6 * size] for some in (pairs, theirs)]
        np.testing.assert_allclose(*lasting, atol=1e-9 * size, err_msg=kind)
