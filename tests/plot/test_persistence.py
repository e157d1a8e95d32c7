import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.features.segmentation import merge_targets, segment
from eigenshape.plot.persistence import KINDS, leaf_places
from eigenshape.plot.render import palette

MESH = es.shapes.torus(30, 16)
NOISE = np.random.default_rng(0).standard_normal(MESH.n_vertices)
PIECES = es.geometry.disjoint_union(es.shapes.torus(20, 12), es.icosphere(2))


def parts_by_targets(tree, persistence):
    """What ends below the cut follows its target, from the most persistent down."""
    into, region = merge_targets(tree), {}
    for number in range(len(into)):
        ends = tree.persistence[number] < persistence
        region[number] = region[into[number]] if ends else number
    return [region[number] for number in range(len(into))]


@pytest.mark.parametrize("cut", [0.1, 0.7, 1.5, 2.5])
def test_merging_into_targets_gives_the_parts_of_a_cut(cut):
    for mesh, values in ((MESH, NOISE), (PIECES, np.round(np.sin(9 * PIECES.vertices[:, 0]) * 4))):
        tree = es.merge_tree(mesh, values)
        parts = segment(tree, persistence=cut)
        expected = parts.features.vertices[parts.labels]
        found = tree.maxima[np.array(parts_by_targets(tree, cut))[tree.basins]]
        assert np.array_equal(found, expected)


def test_no_stem_crosses_a_bar():
    tree = es.merge_tree(MESH, NOISE)
    into = merge_targets(tree)
    place = leaf_places(into)
    assert sorted(place.tolist()) == list(range(len(into)))
    for number, target in enumerate(into.tolist()):
        if target >= 0:
            assert place[target] < place[number]
            between = (place > place[target]) & (place < place[number])
            assert (tree.persistence[between] <= tree.persistence[number]).all()


def test_the_diagram_shows_every_pair():
    found = es.features.persistence_diagram(MESH, NOISE)
    (axes,) = es.plot.figure_diagram(found, label="noise, in volts").axes
    assert "noise, in volts" in axes.get_xlabel()
    shown = [np.asarray(points.get_offsets()) for points in axes.collections]
    assert len(shown) == len(KINDS)
    for kind, points in zip(KINDS, shown, strict=True):
        pairs = getattr(found, kind)
        assert np.array_equal(points, np.column_stack([pairs.births, pairs.deaths]))
        assert (points >= axes.get_xlim()[0]).all()
        assert (points <= axes.get_xlim()[1]).all()
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts[0] == f"maxima, to the saddle that ends them ({len(found.maxima.births)})"


def test_kinds_without_pairs_are_left_out():
    flat = es.features.persistence_diagram(es.shapes.grid(3, 3), np.zeros(16))
    (axes,) = es.plot.figure_diagram(flat).axes
    assert len(axes.collections) == 1
    assert axes.get_xlim()[0] < axes.get_xlim()[1]


def test_the_tree_shows_its_most_persistent_maxima_and_the_cut():
    tree = es.merge_tree(MESH, NOISE)
    cut = float(tree.persistence[5])
    (axes,) = es.plot.figure_merge_tree(tree, persistence=cut, n_maxima=20, label="noise").axes
    stems, bars = axes.collections
    assert len(stems.get_segments()) == 20
    assert len(bars.get_segments()) == 19
    np.testing.assert_allclose(stems.get_colors()[:6, :3], palette(np.arange(6)), atol=0.003)
    assert axes.get_title() == f"cut at {cut:.4g}: 6 regions left"
    assert f"{len(tree.maxima) - 20} more merge by" in axes.get_xlabel()
    assert axes.lines[-1].get_ydata()[0] == cut


def test_a_single_maximum_and_several_that_never_merge(tmp_path):
    lonely = es.merge_tree(es.icosphere(1), es.icosphere(1).vertices[:, 2])
    apart = es.merge_tree(PIECES, PIECES.vertices[:, 2])
    for number, tree in enumerate((lonely, apart)):
        figure = es.plot.figure_merge_tree(tree, persistence=np.inf)
        es.save_figure(figure, tmp_path / f"{number}.png")
        assert "cut at inf" in figure.axes[0].get_title()
    with pytest.raises(InvalidParameterError, match="n_maxima must be at least 1; it is 0"):
        es.plot.figure_merge_tree(lonely, n_maxima=0)
