"""Dense correspondences on creatures whose poses share their vertices, so that the map is known."""

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.topology import submesh
from eigenshape.matching.match import match_shapes
from eigenshape.matching.target import prepare_target

N_VERTICES = 800


def creature(pose):
    return es.make_creature("quadruped", pose, n_vertices=N_VERTICES)


@pytest.fixture(scope="module")
def target():
    return prepare_target(creature(1))


@pytest.fixture(scope="module")
def cut():
    mesh = creature(0)
    height = np.quantile(mesh.vertices[:, 0], 0.6)
    return es.scans.cut_by_planes(mesh, [[1, 0, 0, height]])


@pytest.fixture(scope="module")
def match(target, cut):
    return match_shapes(moved(cut.mesh), target)


@pytest.fixture(scope="module")
def unmoved(target, cut):
    """The map of the part that was not moved."""
    return match_shapes(cut.mesh, target)


def errors(match, target, truth):
    """Errors in hundredths of √area, in space: enough to tell a wrong limb."""
    whole = target.mesh
    unit = np.sqrt(es.geometry.surface_area(whole))
    gaps = match.pull(whole.vertices) - whole.vertices[truth]
    return 100 * np.linalg.norm(gaps, axis=1) / unit


def moved(mesh, factor=1.0):
    """Turn a mesh in space, and scale it."""
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return es.TriangleMesh(factor * mesh.vertices @ turn.T + 3.0, mesh.faces)


def test_a_cut_part_of_another_pose_is_placed(match, target, cut):
    found = errors(match, target, cut.source_vertices)
    assert found.mean() < 5
    assert np.median(found) < 3
    assert match.orientation > 0.3
    assert match.coverage > 0.8


def test_weights_and_corners_give_the_place_of_each_vertex(match, target):
    faces = target.mesh.faces
    assert np.array_equal(match.corners, faces[match.faces])
    assert (match.weights >= -1e-12).all()
    assert np.allclose(match.weights.sum(axis=1), 1)
    rows = np.arange(match.n_vertices)
    assert np.array_equal(match.vertices, match.corners[rows, match.weights.argmax(axis=1)])
    assert ((match.confidence >= 0) & (match.confidence <= 1)).all()


@pytest.mark.long
def test_the_same_input_gives_the_same_digits(match, target, cut):
    one, two = match, match_shapes(moved(cut.mesh), target.mesh)
    for name in ("vertices", "faces", "weights", "confidence"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    assert one.score == two.score


@pytest.mark.long
def test_a_part_whose_faces_look_inward_is_turned_over(target, cut):
    inward = es.TriangleMesh(cut.mesh.vertices, cut.mesh.faces[:, ::-1])
    match = match_shapes(inward, target)
    assert errors(match, target, cut.source_vertices).mean() < 5


@pytest.mark.long
def test_a_mirrored_part_of_a_shape_without_left_and_right_is_not_handed():
    sheet = es.shapes.grid(25, 50, width=1, height=2)
    x, y, z = sheet.vertices.T
    # Narrower at one end: a square can be turned in four ways, among which last digits decide.
    trapezoid = es.TriangleMesh(np.column_stack([(x - 0.5) * (1 - 0.15 * y), y, z]), sheet.faces)
    match = match_shapes(trapezoid, trapezoid)
    assert not match.handed


def test_a_part_of_four_vertices_has_little_confidence(target):
    corners = np.vstack([np.zeros(3), np.eye(3)])
    tetrahedron = es.TriangleMesh(corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    match = match_shapes(tetrahedron, target)
    assert match.vertices.shape == (4,)
    assert match.confidence.max() < 0.25


def test_an_animal_is_handed(match):
    assert match.handed


@pytest.mark.long
def test_each_piece_is_matched_by_itself(target):
    mesh = creature(0)
    low, high = np.quantile(mesh.vertices[:, 0], [0.45, 0.55])
    centers = mesh.vertices[mesh.faces][:, :, 0]
    outside = (centers < low).all(axis=1) | (centers > high).all(axis=1)
    part, vertices = submesh(mesh, outside)
    assert es.geometry.vertex_components(part)[0] > 1
    found = errors(match_shapes(part, target), target, vertices)
    assert np.median(found) < 6


@pytest.mark.long
def test_a_speck_beside_a_part_goes_where_its_neighbors_go_and_is_not_sure(target, cut):
    corner = cut.mesh.vertices[:1]
    speck = corner + 1e-3 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    n = cut.mesh.n_vertices
    both = es.TriangleMesh(
        np.vstack([cut.mesh.vertices, speck]), np.vstack([cut.mesh.faces, [[n, n + 1, n + 2]]])
    )
    match = match_shapes(both, target)
    assert (match.confidence[n:] == 0).all()
    assert np.array_equal(match.faces[n:], np.full(3, match.faces[0]))


@pytest.mark.long
def test_a_whole_in_another_pose_is_matched(target):
    match = match_shapes(creature(0), target)
    assert np.median(errors(match, target, np.arange(target.mesh.n_vertices))) < 3


@pytest.mark.long
def test_another_unit_of_length_is_given_or_found(target, cut):
    part = moved(cut.mesh, 40.0)
    given = match_shapes(part, target, scale=1 / 40)
    assert errors(given, target, cut.source_vertices).mean() < 5
    found = match_shapes(part, target, scale="unknown")
    assert 0.85 < 40 * found.scale < 1.15
    assert errors(found, target, cut.source_vertices).mean() < 8


@pytest.mark.long
def test_a_part_of_something_else_is_less_sure(match, target):
    chair = es.shapes.torus(40, 20)
    size = np.sqrt(es.geometry.surface_area(target.mesh) / es.geometry.surface_area(chair))
    strange = match_shapes(chair, target, scale=float(size))
    assert strange.confidence.mean() < match.confidence.mean() - 0.3
    assert strange.score < match.score


def test_a_tiny_mesh_gets_a_map_that_is_not_sure(target):
    match = match_shapes(es.shapes.grid(1, 1), target)
    assert match.n_vertices == 4
    assert match.confidence.max() < 0.25


def test_a_coarse_mesh_is_placed_where_it_lies():
    fine = es.make_creature("quadruped", n_vertices=1500)
    part, whole = (es.geometry.decimate(fine, n).mesh for n in (100, 130))
    match = match_shapes(moved(part), whole)
    gaps = np.linalg.norm(match.pull(whole.vertices) - part.vertices, axis=1)
    # Eigenfunctions, of which there are few, would move vertices by 7 hundredths of √area.
    assert 100 * gaps.mean() / np.sqrt(es.geometry.surface_area(whole)) < 3


def test_a_coarse_mesh_is_mapped_onto_a_fine_one_as_well_as_a_fine_one():
    """With 300 vertices, patches and eigenfunctions were so coarse that vertices were 7 hundredths off."""
    poses = [es.make_creature("hand", pose, n_vertices=3000) for pose in (0, 1)]
    coarse = es.geometry.decimate(poses[1], 300).mesh
    same = np.linalg.norm(coarse.vertices[:, None] - poses[1].vertices, axis=2).argmin(axis=1)
    match = match_shapes(coarse, poses[0])
    errors = np.linalg.norm(match.pull(poses[0].vertices) - poses[0].vertices[same], axis=1)
    assert errors.mean() < 0.02 * np.sqrt(es.geometry.surface_area(poses[0]))
    assert match.confidence.mean() > 0.8


def test_values_and_labels_are_pulled_back(match, target):
    whole = target.mesh
    places = match.pull(whole.vertices)
    assert np.allclose(match.pull(whole.vertices[:, 0]), places[:, 0])
    labels = np.arange(whole.n_vertices)
    assert np.array_equal(match.pull(labels), match.vertices)
    with pytest.raises(InvalidParameterError, match="a row for each vertex of the whole"):
        match.pull([1.0, 2.0])


def test_the_gap_after_bending_is_less_than_an_edge(match, target):
    edge = es.geometry.edge_lengths(target.mesh).mean()
    edge /= np.sqrt(es.geometry.surface_area(target.mesh))
    gaps = match.evidence[:, 5]  # of `ShapeMatch.evidence`, in units of the root of the area
    assert np.abs(gaps).max() < edge
    assert gaps.min() < 0  # what lies between vertices is no gap


def test_a_match_is_written_as_a_table_a_list_or_arrays(match, tmp_path):
    for suffix in (".csv", ".txt", ".npz"):
        match.save(tmp_path / f"map{suffix}")
    table = np.genfromtxt(tmp_path / "map.csv", delimiter=",", names=True)
    assert np.array_equal(table["whole_vertex"], match.vertices)
    np.testing.assert_allclose(table["confidence"], match.confidence, rtol=1e-3)
    assert np.array_equal(np.loadtxt(tmp_path / "map.txt", dtype=int), match.vertices)
    assert np.array_equal(np.load(tmp_path / "map.npz")["weights"], match.weights)
    with pytest.raises(
        InvalidParameterError, match=r"ends in \.csv, \.txt or \.npz; .* in '\.ply'"
    ):
        match.save(tmp_path / "map.ply")


def test_sure_vertices_are_those_above_a_confidence(match):
    assert np.array_equal(match.sure(0.7), match.confidence >= 0.7)


@pytest.mark.long
def test_a_match_is_a_list_of_vertices_for_other_functions(match, target, cut):
    plan = es.stability.StabilityPlan(k=5, n_samples=100)
    one = es.compare_shapes(cut.mesh, target.mesh, plan, partners=match)
    two = es.compare_shapes(cut.mesh, target.mesh, plan, partners=match.vertices)
    assert one.closeness.displacement.max() == two.closeness.displacement.max()


@pytest.mark.long
def test_a_whole_of_two_pieces_is_matched_piece_by_piece(target):
    """An animal and a ring, matched to another pose of the animal and the same ring, in meters."""
    meters = 0.01  # areas are far below one
    animal = es.TriangleMesh(meters * target.mesh.vertices, target.mesh.faces)
    ring = es.shapes.torus(30, 15)
    size = np.sqrt(es.geometry.surface_area(animal) / es.geometry.surface_area(ring))
    ring = es.TriangleMesh(0.7 * size * ring.vertices + 9 * meters, ring.faces)
    whole = es.geometry.disjoint_union(ring, animal)
    part = es.geometry.disjoint_union(moved(creature(0), meters), ring)
    match = match_shapes(part, whole)
    n = animal.n_vertices
    gaps = match.pull(whole.vertices)[:n] - animal.vertices
    assert np.median(np.linalg.norm(gaps, axis=1)) < 0.05 * size
    assert (match.vertices[n:] < ring.n_vertices).all()
    assert "piece 0 of the part was placed on piece 0 of the whole" in match.report


@pytest.mark.long
def test_a_part_fits_both_of_two_equal_pieces():
    fish = es.make_creature("fish", n_vertices=500)
    beside = es.TriangleMesh(fish.vertices + 3.0, fish.faces)
    whole = prepare_target(es.geometry.disjoint_union(fish, beside))
    alone, one = match_shapes(moved(fish), fish), match_shapes(moved(fish), whole)
    assert (alone.n_equally_good, one.n_equally_good) == (1, 2)
    assert alone.confidence.mean() > 0.9
    assert 0.4 < one.confidence.mean() <= 0.5
    assert one.report[-1].startswith("piece 0 of the part fits piece ")
    # Two fishes fit in two ways, and each of them may be either.
    two = match_shapes(es.geometry.disjoint_union(moved(fish), fish), whole)
    assert two.n_equally_good == 2
    assert two.confidence.max() <= 0.5
    assert np.unique(two.vertices // fish.n_vertices).tolist() == [0, 1]


@pytest.mark.long
def test_a_speck_beside_a_whole_is_left_out_by_name(target, cut, unmoved):
    speck = es.TriangleMesh(1e-3 * np.eye(3), [[0, 1, 2]])
    whole = prepare_target(es.geometry.disjoint_union(speck, target.mesh))
    (sentence,) = whole.report
    assert sentence.startswith("1 loose piece of ")
    assert sentence.endswith(" % of the area of the whole was left out")
    beside = match_shapes(cut.mesh, whole)
    assert np.array_equal(beside.vertices, unmoved.vertices + 3)
    assert beside.report == whole.report


@pytest.mark.long
def test_a_whole_whose_faces_look_inward_gives_the_same_places(target, cut, unmoved):
    inward = es.TriangleMesh(target.mesh.vertices, target.mesh.faces[:, ::-1])
    found = match_shapes(cut.mesh, inward)
    assert np.allclose(found.pull(target.mesh.vertices), unmoved.pull(target.mesh.vertices))


@pytest.mark.long
def test_a_surface_with_needles_is_matched_as_if_it_had_none(target, cut):
    """Smoothing shrinks faces at needles until no operator can be solved."""
    mesh = target.mesh
    # Split faces near one of their corners, by far less than smoothing moves a vertex.
    chosen = np.arange(0, mesh.n_faces, 40)
    a, b, c = (mesh.vertices[mesh.faces[chosen, k]] for k in range(3))
    new = np.arange(len(chosen)) + mesh.n_vertices
    corners = mesh.faces[chosen].T
    split = [np.column_stack([corners[i], corners[(i + 1) % 3], new]) for i in range(3)]
    faces = np.vstack([np.delete(mesh.faces, chosen, axis=0), *split])
    needles = es.TriangleMesh(
        np.vstack([mesh.vertices, a + 1e-6 * (b - a) + 1e-6 * (c - a)]), faces
    )
    match = match_shapes(cut.mesh, needles)
    gaps = match.pull(needles.vertices) - mesh.vertices[cut.source_vertices]
    unit = np.sqrt(es.geometry.surface_area(mesh))
    assert np.median(np.linalg.norm(gaps, axis=1)) < 0.03 * unit


@pytest.mark.long
def test_another_individual_is_scaled_by_the_root_of_the_ratio_of_areas(target):
    match = match_shapes(moved(creature(0), 2.0), target)
    assert match.scale == pytest.approx(0.5, rel=0.05)
    assert "the root of the ratio of areas: both shapes are complete" in match.report[0]
    assert np.median(errors(match, target, np.arange(N_VERTICES))) < 3


@pytest.mark.long
def test_a_part_in_another_unit_is_searched_for_by_itself(target, cut):
    match = match_shapes(moved(cut.mesh, 1000.0), target)
    assert match.scale == pytest.approx(1e-3, rel=0.15)
    assert "which fits best" in match.report[0]


@pytest.mark.long
@pytest.mark.parametrize(
    ("part", "whole"),
    [
        (es.icosphere(3), es.icosphere(3)),
        (es.shapes.torus(40, 20), es.shapes.torus(40, 20)),
        (es.shapes.fibonacci_sphere(1000), es.icosphere(3)),
        (es.icosphere(4), es.icosphere(4)),
    ],
    ids=["ball", "ring", "ball with other triangles", "large ball"],
)
def test_a_shape_that_turns_into_itself_has_several_maps(part, whole):
    match = match_shapes(moved(part), whole)
    assert match.n_equally_good >= 4
    assert match.confidence.mean() < 0.3


@pytest.mark.long
def test_an_animal_has_one_map(match, target):
    assert match.n_equally_good == 1
    assert match_shapes(moved(target.mesh), target).n_equally_good == 1


def test_a_part_that_is_larger_than_the_whole_is_refused(target):
    with pytest.raises(InvalidParameterError, match=r"more than 1\.5 times the area of the whole"):
        match_shapes(moved(creature(0), 2.0), target, scale="known")


@pytest.mark.long
def test_a_part_whose_noise_adds_to_its_area_is_not_refused(target):
    """The area counts without the noise."""
    area = es.geometry.surface_area
    clean = moved(creature(0), float(np.sqrt(1.4 * area(target.mesh) / area(creature(0)))))
    edge = es.geometry.edge_lengths(clean).mean()
    noise = 0.25 * edge * np.random.default_rng(0).standard_normal(clean.vertices.shape)
    noisy = es.TriangleMesh(clean.vertices + noise, clean.faces)
    assert area(noisy) > 1.5 * area(target.mesh)
    assert match_shapes(noisy, target).n_vertices == noisy.n_vertices


def test_pieces_that_are_all_tiny_are_refused(target, cut):
    dots = 1e-3 * es.icosphere(0).vertices
    faces = es.icosphere(0).faces
    two = es.TriangleMesh(np.vstack([dots, dots + 1]), np.vstack([faces, faces + len(dots)]))
    with pytest.raises(InvalidParameterError, match="a piece with 1% of the area of the whole"):
        match_shapes(two, target, scale="known")


@pytest.mark.parametrize("scale", ["guess", 0.0, -1.0, np.nan, np.inf])
def test_a_scale_that_is_none_is_refused(target, cut, scale):
    with pytest.raises(
        InvalidParameterError, match=r'scale must be "auto", "known", "unknown" or a positi'
    ):
        match_shapes(cut.mesh, target, scale=scale)


def test_progress_ends_at_one(target):
    seen = []
    match_shapes(es.shapes.grid(1, 1), target, progress=lambda share, _: seen.append(share))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
