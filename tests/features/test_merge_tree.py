import numpy as np
import pytest
from literal_merging import LiteralMerging

from eigenshape._errors import InvalidParameterError
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.segmentation import segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.surfaces import disjoint_union, grid, icosphere, torus
from eigenshape.geometry.topology import submesh


def wavy(mesh, step=0.0):
    x, y, z = mesh.vertices.T
    heights = np.sin(6 * x + 1) * np.cos(5 * y) + 0.3 * np.sin(9 * z)
    return np.round(heights / step) * step if step else heights


def with_holes(mesh, rng):
    return submesh(mesh, rng.random(mesh.n_faces) < 0.85)[0]


MESHES = {
    "sphere": icosphere(2),
    "torus": torus(20, 12),
    "flat grid": grid(9, 8),
    "two pieces": disjoint_union(icosphere(1), torus(9, 7)),
    "holes": with_holes(icosphere(2), np.random.default_rng(3)),
    "many holes": with_holes(torus(18, 10), np.random.default_rng(5)),
}
STEPS = (0.0, 0.05, 0.4, 10.0)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", MESHES)
def test_labels_equal_literal_merging_at_every_number_of_regions(name, step):
    mesh = MESHES[name]
    values = wavy(mesh, step)
    tree = merge_tree(mesh, values)
    everlasting = int(np.isinf(tree.persistence).sum())
    for count in range(everlasting, len(tree.maxima) + 1):
        parts = segment(tree, n_regions=count)
        literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(
            lambda n, p, count=count: n <= count or np.isinf(p)
        )
        assert np.array_equal(parts.features.vertices[parts.labels], literal.labels())


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", MESHES)
def test_labels_equal_literal_merging_at_thresholds(name, step):
    mesh = MESHES[name]
    values = wavy(mesh, step)
    tree = merge_tree(mesh, values)
    for threshold in (*tree.persistence[np.isfinite(tree.persistence)], 0.1, 0.77, 1e-9):
        parts = segment(tree, persistence=float(threshold))
        literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(
            lambda n, p, threshold=threshold: p >= threshold
        )
        assert np.array_equal(parts.features.vertices[parts.labels], literal.labels())


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", MESHES)
def test_pairs_equal_literal_merging(name, step):
    mesh = MESHES[name]
    values = wavy(mesh, step)
    tree = merge_tree(mesh, values)
    literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(lambda n, p: np.isinf(p))
    lasting = sorted(pair for pair in literal.pairs if values[pair[0]] > values[pair[1]])
    finite = np.isfinite(tree.persistence)
    ours = sorted(zip(tree.maxima[finite].tolist(), *tree.saddles[finite].T.tolist(), strict=True))
    assert ours == lasting


def test_two_peaks_on_a_strip():
    strip = grid(6, 1)
    x = strip.vertices[:, 0] * 6
    values = np.where(x < 3, 5 - np.abs(x - 1), 3 - np.abs(x - 5))
    tree = merge_tree(strip, values)
    assert np.isinf(tree.persistence[0])
    assert tree.values[0] == pytest.approx(5)
    assert tree.persistence[1] == pytest.approx(0, abs=3)
    parts = segment(tree, n_regions=1)
    assert set(parts.labels.tolist()) == {0}


def test_three_faces_at_an_edge_are_all_neighbours():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], dtype=float)
    mesh = TriangleMesh(vertices, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    parts = segment(merge_tree(mesh, [0.0, 1.0, 3.0, 2.0, 4.0]), n_regions=1)
    assert parts.labels.tolist() == [0, 0, 0]
    assert parts.features.vertices.tolist() == [4]


@pytest.mark.parametrize(
    ("values", "message"),
    [([0.0, 1.0], "one number a vertex"), ([0.0, np.nan, 1.0, 2.0], "entry 1 is nan")],
)
def test_bad_values_are_named(values, message):
    mesh = grid(1, 1)
    with pytest.raises(InvalidParameterError, match=message):
        merge_tree(mesh, values)


def test_segment_wants_exactly_one_rule():
    tree = merge_tree(grid(3, 3), np.arange(16.0))
    with pytest.raises(InvalidParameterError, match="it was given neither"):
        segment(tree)
    with pytest.raises(InvalidParameterError, match="it was given both"):
        segment(tree, n_regions=2, persistence=0.1)
    with pytest.raises(InvalidParameterError, match="persistence must be at least 0; it is -1"):
        segment(tree, persistence=-1.0)
    with pytest.raises(InvalidParameterError, match=r"n_regions must lie in 1\.\."):
        segment(tree, n_regions=0)
