import numpy as np
import pytest
from literal_merging import LiteralMerging

from certeig.kit.errors import InvalidParameterError
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.segmentation import segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, non_manifold_vertices, submesh
from eigenshape.io.mesh_files import read_mesh
from eigenshape.shapes.surfaces import grid, icosphere, torus


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


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize("step", [0.0, 0.125])
@pytest.mark.parametrize(
    "path", ["horse/sumner_horse-02.ply", "octopus/psb122.ply", "fish/psb222.ply"]
)
def test_labels_of_real_shapes_equal_literal_merging(data, path, step):
    mesh = read_mesh(data / "retrieval" / path)
    values = wavy(
        TriangleMesh(2 * mesh.vertices / np.ptp(mesh.vertices, axis=0).max(), mesh.faces), step
    )
    tree = merge_tree(mesh, values)
    assert len(tree.maxima) > 3
    parts = segment(tree, n_regions=3)
    literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(lambda n, p: n <= 3)
    assert np.array_equal(parts.features.vertices[parts.labels], literal.labels())


def test_two_peaks_on_a_strip():
    strip = grid(6, 1)
    column = np.round(strip.vertices[:, 0] * 6).astype(int)
    tree = merge_tree(strip, np.array([4.0, 5, 4, 1, 2, 3, 2])[column])
    assert tree.values.tolist() == [5, 3]
    assert tree.persistence.tolist() == [np.inf, 2]
    assert tree.parent.tolist() == [-1, 0]
    assert column[tree.maxima].tolist() == [1, 5]
    assert column[tree.saddles[1]].tolist() == [3, 3]
    parts = segment(tree, n_regions=2)
    assert parts.labels.tolist() == (column[strip.faces].max(axis=1) > 3).astype(int).tolist()
    assert set(segment(tree, n_regions=1).labels.tolist()) == {0}
    assert set(segment(tree, persistence=2.0).labels.tolist()) == {0, 1}
    assert set(segment(tree, persistence=2.1).labels.tolist()) == {0}


def test_number_of_regions_is_at_most_that_of_maxima_and_at_least_that_of_components():
    mesh = disjoint_union(icosphere(1), icosphere(1))
    tree = merge_tree(mesh, mesh.vertices[:, 2])
    assert len(tree.maxima) == 2
    for count in (1, 2, 10 * mesh.n_faces):
        assert segment(tree, n_regions=count).features.vertices.tolist() == tree.maxima.tolist()
    assert len(segment(tree, persistence=np.inf).features.vertices) == 2


def test_results_are_int64_and_read_only():
    tree = merge_tree(MESHES["two pieces"], wavy(MESHES["two pieces"]))
    parts = segment(tree, n_regions=4)
    for array in (
        tree.maxima,
        tree.saddles,
        tree.parent,
        tree.basins,
        parts.labels,
        parts.features.vertices,
    ):
        assert array.dtype == np.int64
    for owner in (tree, parts.features):
        for array in vars(owner).values():
            assert not array.flags.writeable
    assert not parts.labels.flags.writeable


def fan(n_spokes, apex):
    """Triangles around one vertex, which has more sides than are sorted by insertion."""
    angles = 2 * np.pi * np.arange(n_spokes) / n_spokes
    rim = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n_spokes)])
    ring = np.arange(n_spokes)
    faces = np.column_stack([ring, np.roll(ring, -1), np.full(n_spokes, n_spokes)])
    return TriangleMesh(np.vstack([rim, [0, 0, apex]]), faces)


@pytest.mark.parametrize("apex", [-2.0, 0.1, 2.0])
@pytest.mark.parametrize("step", [0.0, 0.5])
def test_labels_around_a_vertex_of_many_faces_equal_literal_merging(step, apex):
    mesh = fan(90, apex)
    values = wavy(mesh, step) + mesh.vertices[:, 2]
    tree = merge_tree(mesh, values)
    for count in range(1, len(tree.maxima) + 1):
        parts = segment(tree, n_regions=count)
        literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(
            lambda n, p, count=count: n <= count or np.isinf(p)
        )
        assert np.array_equal(parts.features.vertices[parts.labels], literal.labels())


def test_pages_of_a_book_are_all_neighbors_at_its_spine():
    # 60 faces at one edge, more than are sorted by insertion: page i ends at the spine, the next higher page beyond it.
    heights = np.random.default_rng(0).permutation(60) + 1.0
    points = np.column_stack([np.cos(heights), np.sin(heights), np.zeros(60)])
    faces = [[60, 61, page] for page in range(60)]
    mesh = TriangleMesh(np.vstack([points, [[0, 0, 0], [0, 0, 1]]]), faces)
    tree = merge_tree(mesh, [*heights, 0.0, 0.0])
    assert tree.values.tolist() == list(range(60, 0, -1))
    assert tree.parent.tolist() == list(range(-1, 59))
    assert tree.persistence.tolist() == [np.inf, *range(59, 0, -1)]


def test_faces_that_repeat_a_vertex_or_each_other_are_merged_too():
    mesh = TriangleMesh(np.eye(4, 3), [[0, 1, 2], [0, 1, 2], [2, 2, 1], [1, 2, 3], [3, 3, 3]])
    parts = segment(merge_tree(mesh, [1.0, 2.0, 3.0, 4.0]), n_regions=1)
    assert parts.labels.tolist() == [1, 1, 1, 1, 0]
    assert parts.features.vertices.tolist() == [3, 3]


def test_three_faces_at_an_edge_are_all_neighbors():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], dtype=float)
    mesh = TriangleMesh(vertices, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    parts = segment(merge_tree(mesh, [0.0, 1.0, 3.0, 2.0, 4.0]), n_regions=1)
    assert parts.labels.tolist() == [0, 0, 0]
    assert parts.features.vertices.tolist() == [4]


@pytest.mark.parametrize(
    ("values", "message"),
    [([0.0, 1.0], "one number per vertex"), ([0.0, np.nan, 1.0, 2.0], "entry 1 is nan")],
)
def test_bad_values_are_named(values, message):
    mesh = grid(1, 1)
    with pytest.raises(InvalidParameterError, match=message):
        merge_tree(mesh, values)


def test_segment_wants_exactly_one_rule():
    tree = merge_tree(grid(3, 3), np.arange(16.0))
    with pytest.raises(InvalidParameterError, match="it was given none"):
        segment(tree)
    with pytest.raises(InvalidParameterError, match="it was given n_regions and persistence"):
        segment(tree, n_regions=2, persistence=0.1)
    with pytest.raises(InvalidParameterError, match="persistence must be at least 0; it is -1"):
        segment(tree, persistence=-1.0)
    with pytest.raises(InvalidParameterError, match="n_regions must be at least 1; it is 0"):
        segment(tree, n_regions=0)
    with pytest.raises(
        InvalidParameterError, match="exactly one of n_regions, persistence and largest_gap"
    ):
        segment(tree, persistence=1.0, largest_gap=True)


def peaks(*heights):
    """A strip with a peak of each height, and a valley at 0 between any two."""
    levels = np.array([level for height in heights for level in (0.0, height)] + [0.0])
    strip = grid(len(levels) - 1, 1)
    return strip, levels[np.round(strip.vertices[:, 0] * (len(levels) - 1)).astype(int)]


@pytest.mark.parametrize("unit", [1.0, 1e100, 1e-100])
@pytest.mark.parametrize(
    ("heights", "left"),
    [
        ((9, 10, 8.5, 1, 0.5), [10, 9, 8.5]),  # the gap from 8.5 to 1
        (
            (10, 1, 0.9, 0.8),
            [10, 1, 0.9, 0.8],
        ),  # from .8 to 0: the one that never ends does not count
        ((10, 6, 3), [10, 6]),  # two equal gaps, the first is taken
        ((10,), [10]),
        ((5, 5, 2), [5, 5]),
    ],
)
def test_the_largest_gap_of_persistence(heights, left, unit):
    mesh, values = peaks(*heights)
    parts = segment(merge_tree(mesh, unit * values), largest_gap=True)
    assert parts.features.values.tolist() == [unit * value for value in left]
    assert set(parts.labels.tolist()) == set(range(len(left)))


@pytest.mark.parametrize(
    "rule", [{"n_regions": 1}, {"n_regions": 99}, {"persistence": 0.0}, {"largest_gap": True}]
)
def test_a_constant_function_has_one_region_a_component(rule):
    mesh = disjoint_union(icosphere(1), torus(9, 7), grid(3, 2))
    parts = segment(merge_tree(mesh, np.full(mesh.n_vertices, -2.5)), **rule)
    assert np.isinf(parts.features.persistence).tolist() == [True] * 3
    assert [len(set(part.tolist())) for part in np.split(parts.labels, [80, 80 + 126])] == [1, 1, 1]


def test_a_bow_tie_is_two_regions_that_no_edge_joins():
    # Two squares that share their one corner, the highest vertex of both: faces meet over edges alone.
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0]], dtype=float
    )
    mesh = TriangleMesh(corners, [[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]])
    parts = segment(merge_tree(mesh, [0.0, 1, 9, 2, 3, 4, 5]), n_regions=1)
    assert parts.labels.tolist() == [1, 1, 0, 0]
    assert parts.features.vertices.tolist() == [2, 2]
    assert np.isinf(parts.features.persistence).all()


@pytest.mark.parametrize("step", STEPS)
def test_a_boundary_that_passes_a_vertex_twice(step):
    sheet = grid(8, 8)
    center = sheet.vertices[sheet.faces].mean(axis=1) - [0.5, 0.5, 0.0]
    around = np.flatnonzero(
        (sheet.vertices[sheet.faces] == [0.5, 0.5, 0.0]).all(axis=2).any(axis=1)
    )
    around = around[np.argsort(np.arctan2(center[around, 1], center[around, 0]))]
    mesh = submesh(sheet, ~np.isin(np.arange(sheet.n_faces), around[[0, 3]]))[0]
    assert len(non_manifold_vertices(mesh)) == 1
    values = wavy(mesh, step)
    tree = merge_tree(mesh, values)
    for count in range(1, len(tree.maxima) + 1):
        parts = segment(tree, n_regions=count)
        literal = LiteralMerging(mesh.faces.tolist(), values.tolist()).run(
            lambda n, p, count=count: n <= count or np.isinf(p)
        )
        assert np.array_equal(parts.features.vertices[parts.labels], literal.labels())
