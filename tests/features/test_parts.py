import itertools

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.features import boundaries
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.contrast import FINE_CONTRAST, contrast_at
from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.part_contrast import SIGHT_REACH, lines_of_sight
from eigenshape.features.part_merging import SEED_TIME, part_tree
from eigenshape.features.parts import find_parts
from eigenshape.features.segmentation import FeaturePoints, Segmentation, adjacent_parts, segment
from eigenshape.geometry.facets import facet_components, facet_table
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import disjoint_union, edge_table, submesh
from eigenshape.operators.anisotropic import curvature_tensors
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum


def dumbbell(neck=0.25):
    """Return two balls joined by a neck: a sphere squeezed around its middle."""
    ball = icosphere(4)
    x, y, z = ball.vertices.T
    width = neck + (1 - neck) * np.minimum(np.abs(x) / 0.5, 1)
    return TriangleMesh(np.column_stack([1.5 * x, y * width, z * width]), ball.faces)


@pytest.fixture(scope="module")
def human():
    return find_parts(make_creature("biped", n_vertices=2000))


def n_pieces(mesh, keep):
    return facet_components(facet_table(submesh(mesh, keep)[0]))[0]


def test_a_dumbbell_has_two_parts_and_the_cut_is_at_the_neck():
    mesh = dumbbell()
    found = find_parts(mesh)
    assert len(found.parts.features.vertices) == 2
    centers = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    one = np.mean(centers[found.parts.labels == 0]) > 0
    agree = (centers > 0) == ((found.parts.labels == 0) == one)
    assert agree[np.abs(centers) > 0.15].all()


def test_both_ends_of_a_bone_are_parts():
    ball = icosphere(4)
    x, y, z = ball.vertices.T
    width = 1 + 2 * np.exp(-(((z - 1) / 0.4) ** 2)) + 1.5 * np.exp(-(((z + 1) / 0.4) ** 2))
    bone = TriangleMesh(np.column_stack([width * x, width * y, 4 * z]), ball.faces)
    labels = find_parts(bone).parts.labels
    heights = bone.vertices[bone.faces].mean(axis=1)[:, 2]
    top, middle, bottom = (labels[np.abs(heights - at).argmin()] for at in (3.5, 0, -3.5))
    assert len(np.unique(labels)) == len({top, middle, bottom}) == 3


def test_a_ball_is_one_part():
    assert len(find_parts(icosphere(3)).parts.features.vertices) == 1


def test_persistence_is_what_is_left_of_a_difference_between_two_parts():
    mesh = dumbbell()
    spectrum = find_parts(mesh).spectrum
    tree = part_tree(mesh, spectrum, time=0.2)
    labels = segment(tree, n_regions=2).labels
    areas = face_areas(mesh)
    share = np.array([areas[labels == part].sum() for part in (0, 1)])
    level = np.where(labels == 0, 1 / share[0], -1 / share[1]) / np.sqrt((1 / share).sum())
    means = spectrum.eigenvectors[mesh.faces].mean(axis=1)
    left = np.exp(-0.2 * areas.sum() * spectrum.eigenvalues) * ((areas * level) @ means)
    assert tree.persistence[1] == pytest.approx((left**2).sum(), rel=1e-9)


def brute_force_merging(mesh, spectrum, time):
    """Merge the cheapest pair of touching regions again and again, all prices computed anew from the faces."""
    areas = face_areas(mesh)
    area = areas.sum()
    heat = heat_kernel_signature(spectrum, [SEED_TIME * spectrum.mass.sum()])[:, 0]
    labels = segment(merge_tree(mesh, heat), n_regions=150).labels.copy()
    decay = np.exp(-time * area * spectrum.eigenvalues)
    faces = (spectrum.eigenvectors * decay)[mesh.faces].mean(axis=1)
    prices = []
    while len(touching := adjacent_parts(mesh, labels)):

        def price(pair):
            one, two = (labels == part for part in pair)
            a, b = areas[one].sum(), areas[two].sum()
            gap = areas[one] @ faces[one] / a - areas[two] @ faces[two] / b
            return a * b / (a + b) * (gap @ gap)

        cheapest = min(touching.tolist(), key=price)
        prices.append(price(cheapest))
        labels[labels == cheapest[1]] = cheapest[0]
    return np.maximum.accumulate(prices)


@pytest.mark.long
def test_part_tree_merges_the_cheapest_pair_each_time():
    mesh = make_creature("fish", n_vertices=600)
    spectrum = find_parts(mesh).spectrum
    tree = part_tree(mesh, spectrum)
    expected = brute_force_merging(mesh, spectrum, 0.1)
    np.testing.assert_allclose(tree.persistence[1:], expected[::-1], rtol=1e-9)


@pytest.mark.parametrize("first", [0, 1])
def test_parts_of_several_components_stand_by_their_height(first):
    ball = icosphere(2)
    both = TriangleMesh(3 + 2 * ball.vertices, ball.faces), ball
    mesh = disjoint_union(both[first], both[1 - first])
    tree = part_tree(mesh, find_parts(mesh, n_modes=40).spectrum)
    assert (tree.parent[:2] == -1).all()
    assert tree.values[0] > tree.values[1]
    assert sorted(tree.maxima[:2] < ball.n_vertices) == [False, True]


@pytest.mark.long
def test_a_part_splits_from_one_that_stands_before_it_and_is_higher(human):
    tree = human.tree
    number = np.arange(len(tree.maxima))
    ends = tree.parent >= 0
    assert (tree.parent[ends] < number[ends]).all()
    assert (tree.values[tree.parent[ends]] >= tree.values[ends]).all()
    assert (np.diff(tree.persistence) <= 0).all()
    assert ((tree.persistence[ends] >= 0) & (tree.persistence[ends] <= 1)).all()


def test_cuts_are_nested_and_take_away_one_part_at_a_time(human):
    finer = segment(human.tree, n_regions=9).labels
    for count in range(8, 0, -1):
        labels = segment(human.tree, n_regions=count).labels
        assert labels.max() == count - 1
        assert all(len(np.unique(labels[finer == part])) == 1 for part in range(count + 1))
        finer = labels


def test_a_human_has_a_head_four_limbs_and_a_torso(human):
    mesh, labels = human.mesh, human.parts.labels
    shares = np.bincount(labels, weights=face_areas(mesh)) / face_areas(mesh).sum()
    assert shares.max() < 0.5
    x, y, _ = mesh.vertices.T
    ends = [int(np.argmax(y)), int(np.argmax(x)), int(np.argmin(x))]
    ends += [int(np.argmin(np.where(side * x > 0, y, np.inf))) for side in (1, -1)]
    own = [labels[np.flatnonzero((mesh.faces == end).any(axis=1))[0]] for end in ends]
    assert len(set(own)) == 5, "head, hands and feet lie in parts of their own"
    assert len(np.unique(labels)) > 5, "the torso belongs to none of them"


@pytest.mark.long
@pytest.mark.parametrize(("kind", "n", "count"), [("biped", 5000, 9), ("quadruped", 2000, 8)])
def test_the_parts_are_the_same_ones_in_another_pose(kind, n, count):
    # On a biped of 2000 vertices, two halves of limbs are too near the cut.
    one, two = (find_parts(make_creature(kind, pose, n_vertices=n)).parts for pose in (0, 3))
    assert len(one.features.vertices) == len(two.features.vertices) == count
    assert disagreement(one.labels, two.labels) < 0.06


def fish_body(tail_is_thin):
    """Return a long ball, one half of which is flat or not."""
    ball = icosphere(4)
    x, y, z = ball.vertices.T
    thickness = np.where(tail_is_thin & (x > 0), 1 - 0.9 * np.minimum(x / 0.4, 1), 1.0)
    return TriangleMesh(np.column_stack([2.5 * x, y, z * thickness]), ball.faces)


def test_a_difference_in_thickness_separates_parts():
    plain, flat = (find_parts(fish_body(thin)).tree.persistence[1] for thin in (False, True))
    assert flat > plain


def test_lines_of_sight_run_inside_a_slab_but_not_along_it_nor_outside():
    # Two points on top of a slab, one below it, and one above that faces them across a gap.
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0, -0.1], [0, 0, 0.1]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1], [0, 0, -1], [0, 0, -1]])
    lines, clear = lines_of_sight(points, normals)
    np.testing.assert_array_equal(np.argwhere(np.triu(clear)), [[0, 2], [1, 2]])
    np.testing.assert_array_equal(clear, clear.T)
    np.testing.assert_allclose(lines[0, 1], np.exp(-((0.1 / SIGHT_REACH) ** 2)), rtol=1e-14)
    np.testing.assert_array_equal(clear[clear > 0], lines[clear > 0])


def test_persistence_falls_below_the_fine_cut_as_in_the_tree_of_diffusion(human):
    finer = part_tree(human.mesh, human.spectrum)
    low = finer.persistence < FINE_CONTRAST
    np.testing.assert_array_equal(human.tree.persistence[low], finer.persistence[low])
    np.testing.assert_array_equal(human.tree.maxima[low], finer.maxima[low])
    assert (human.tree.persistence[~low] >= FINE_CONTRAST).all()


def test_levels_beyond_the_fine_cut_have_smooth_boundaries(human):
    found = find_parts(human.mesh, level=2)
    raw = segment(human.tree, persistence=contrast_at(2.0))
    assert len(found.parts.features.vertices) == len(raw.features.vertices)
    assert cut_length(human.mesh, found.parts.labels) < cut_length(human.mesh, raw.labels)


def disagreement(one, two):
    """Return 1 - Rand index."""
    table = np.zeros((one.max() + 1, two.max() + 1))
    np.add.at(table, (one, two), 1)
    pairs = sum((counts * (counts - 1)).sum() for counts in (table.sum(axis=0), table.sum(axis=1)))
    return (pairs - 2 * (table * (table - 1)).sum()) / (len(one) * (len(one) - 1))


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_parts_know_no_unit(scale):
    mesh = make_creature("quadruped", n_vertices=800)
    found, far = find_parts(mesh), find_parts(TriangleMesh(mesh.vertices * scale, mesh.faces))
    # Which of two legs that mirror each other has the smaller number, the last digit decides.
    assert disagreement(found.parts.labels, far.parts.labels) == 0
    np.testing.assert_allclose(found.tree.persistence, far.tree.persistence, rtol=1e-6)


def test_a_closed_mesh_is_turned_outward():
    mesh = make_creature("quadruped", n_vertices=800)
    turned = find_parts(TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]))
    assert disagreement(turned.parts.labels, find_parts(mesh).parts.labels) == 0


def test_each_component_is_a_part_at_least():
    apart = TriangleMesh(0.3 * icosphere(2).vertices + 9, icosphere(2).faces)
    found = find_parts(disjoint_union(dumbbell(), apart))
    assert np.isinf(found.parts.features.persistence).sum() == 2
    assert len(found.parts.features.vertices) == 3


def cut_length(mesh, labels):
    table = edge_table(mesh)
    pairs, edges = table.face_pairs
    ends = mesh.vertices[table.edges[edges[labels[pairs[:, 0]] != labels[pairs[:, 1]]]]]
    return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()


def two_halves(mesh, ragged):
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    labels = (centers[:, 0] > ragged * np.sin(5 * np.arctan2(centers[:, 2], centers[:, 1]))).astype(
        np.int64
    )
    tips = np.array([mesh.vertices[:, 0].argmin(), mesh.vertices[:, 0].argmax()])
    return Segmentation(labels, FeaturePoints(tips, np.ones(2), np.array([np.inf, 0.5])))


def test_a_ragged_boundary_becomes_straight():
    mesh = dumbbell()
    ragged = two_halves(mesh, 0.25)
    smooth = smooth_boundaries(mesh, ragged)
    neck = cut_length(mesh, two_halves(mesh, 0.0).labels)
    assert cut_length(mesh, ragged.labels) > 2 * neck
    assert cut_length(mesh, smooth.labels) < 1.05 * neck
    assert smooth.features is ragged.features


def network_of(mesh):
    tensors = curvature_tensors(mesh, boundaries.CONCAVITY, concave=True)
    return boundaries.build_network(mesh, tensors)


@pytest.mark.long
def test_a_coarse_cut_that_is_refined_costs_hardly_more(monkeypatch):
    mesh = subdivide(make_creature("quadruped", n_vertices=3000))
    parts = find_parts(mesh)
    raw = segment(parts.tree, n_regions=len(parts.parts.features.vertices))
    network = network_of(mesh)

    def cost(labels):
        return network.costs[labels[network.pairs[:, 0]] != labels[network.pairs[:, 1]]].sum()

    exact = smooth_boundaries(mesh, raw).labels
    monkeypatch.setattr(boundaries, "MOST_FACES", 1000)
    monkeypatch.setattr(boundaries, "N_CELLS", 800)
    refined = smooth_boundaries(mesh, raw).labels
    assert cost(refined) <= 1.03 * cost(exact)
    assert cost(exact) < 0.5 * cost(raw.labels)
    assert np.mean(refined != exact) < 0.05
    # Nothing is free in bands that are as narrow as their cells allow.
    monkeypatch.setattr(boundaries, "CELLS_AROUND", 1000)
    np.testing.assert_array_equal(smooth_boundaries(mesh, raw).labels, exact)


def test_no_cut_in_the_band_costs_less():
    mesh = dumbbell()
    before = two_halves(mesh, 0.25)
    after = smooth_boundaries(mesh, before).labels
    network = network_of(mesh)

    def cost(labels):
        return network.costs[labels[network.pairs[:, 0]] != labels[network.pairs[:, 1]]].sum()

    moved = np.flatnonzero(np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 0]) < 0.3)
    rng = np.random.default_rng(4)
    for face in rng.choice(moved, 200, replace=False):
        other = after.copy()
        other[face] = 1 - other[face]
        assert cost(other) >= cost(after) * (1 - 1e-6)
    assert cost(after) < cost(before.labels)


def test_smooth_parts_stay_whole_and_keep_their_feature_points(human):
    raw = segment(human.tree, n_regions=12)
    smooth = smooth_boundaries(human.mesh, raw)
    for part in range(12):
        assert (
            n_pieces(human.mesh, smooth.labels == part)
            == n_pieces(human.mesh, raw.labels == part)
            == 1
        )
        around = (human.mesh.faces == smooth.features.vertices[part]).any(axis=1)
        assert (smooth.labels[around & (raw.labels == part)] == part).all()


def test_adjacent_parts_need_a_label_for_each_face():
    with pytest.raises(
        InvalidParameterError, match=r"labels must hold one whole number per face, shape \(8,\)"
    ):
        adjacent_parts(grid(4, 1), np.array([0]))


def test_adjacent_parts_of_a_strip():
    mesh = grid(7, 2)
    labels = np.minimum(
        (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] * 3.0001 / np.ptp(mesh.vertices[:, 0])), 2
    )
    assert adjacent_parts(mesh, labels.astype(np.int64)).tolist() == [[0, 1], [1, 2]]


def test_a_spectrum_of_another_shape_is_refused():
    spectrum = solve_spectrum(cotangent_laplacian(icosphere(1)), 5)
    with pytest.raises(
        InvalidParameterError,
        match=r"spectrum must be of the mesh; it has 42 points for 162 vertices",
    ):
        part_tree(icosphere(2), spectrum)


def test_times_widths_and_modes_must_be_positive():
    mesh = icosphere(1)
    with pytest.raises(InvalidParameterError, match="time must be positive"):
        part_tree(mesh, solve_spectrum(cotangent_laplacian(mesh), 5), time=0)
    with pytest.raises(InvalidParameterError, match="width must be positive"):
        smooth_boundaries(mesh, two_halves(mesh, 0.0), width=-1.0)
    with pytest.raises(InvalidParameterError, match="n_modes must be at least 2"):
        find_parts(mesh, n_modes=1)


def test_finer_levels_have_more_parts_that_lie_within_those_of_coarser_ones(human):
    cuts = [segment(human.tree, persistence=contrast_at(level)) for level in (-1, 0, 1, 2)]
    counts = [len(cut.features.vertices) for cut in cuts]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]
    for coarse, fine in itertools.pairwise(cuts):
        pairs = np.unique(np.column_stack([fine.labels, coarse.labels]), axis=0)
        assert len(pairs) == len(fine.features.vertices)
    found = find_parts(human.mesh, level=1)
    assert len(found.parts.features.vertices) == counts[2]


def test_a_level_must_be_finite():
    with pytest.raises(InvalidParameterError, match="level must be finite"):
        find_parts(icosphere(1), level=np.inf)


def test_a_face_without_area_is_refused():
    flat = TriangleMesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 1, 3]])
    )
    with pytest.raises(InvalidShapeError, match="area"):
        find_parts(flat)
