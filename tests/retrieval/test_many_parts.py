"""Shapes of many parts and loose fragments are described like all others."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.geometry.repairs.repair_steps import fragment_vertices
from eigenshape.retrieval.patches.patches import surface_patches
from eigenshape.scans.partial import views_of

RECIPE = es.retrieval.HeatRecipe(n_modes=40)


def moved(mesh, scale, to):
    return es.TriangleMesh(scale * mesh.vertices + np.asarray(to), mesh.faces)


def with_specks(body, n, scale=0.004):
    places = np.random.default_rng(0).standard_normal((n, 3))
    return es.geometry.disjoint_union(
        body, *[moved(es.icosphere(0), scale, place) for place in places]
    )


BODY = es.make_creature("quadruped", 0, n_vertices=800)
SPECKED = with_specks(BODY, 70)
SOUP = es.geometry.disjoint_union(*[moved(es.icosphere(1), 1.0, [3 * i, 0, 0]) for i in range(40)])
DUST = es.geometry.disjoint_union(
    *[moved(es.icosphere(0), 1.0, [3 * i, 0, 0]) for i in range(1000)]
)


def test_fragments_by_hand():
    mesh = es.geometry.disjoint_union(
        es.icosphere(1),
        moved(es.icosphere(1), 0.09, [3, 0, 0]),
        moved(es.icosphere(1), 0.2, [5, 0, 0]),
    )
    assert fragment_vertices(mesh).tolist() == list(range(42, 84)), (
        "0.8 % of the area; the last has 3.8 %"
    )
    assert fragment_vertices(mesh, 10).tolist() == list(range(42, 126))
    assert not len(fragment_vertices(es.icosphere(1)))
    assert not len(fragment_vertices(SOUP))
    assert fragment_vertices(DUST).tolist() == list(range(1200, 12000)), (
        "of equal ones the first hundred stay"
    )


def test_specks_leave_the_features_of_a_body_as_they_are():
    alone, found = (
        es.retrieval.find_heat_features(BODY, RECIPE),
        es.retrieval.find_heat_features(SPECKED, RECIPE),
    )
    assert found.descriptor.vertices.tolist() == alone.descriptor.vertices.tolist()
    np.testing.assert_allclose(found.descriptor.vectors, alone.descriptor.vectors, rtol=1e-9)
    assert found.fragments.tolist() == list(range(800, SPECKED.n_vertices))
    n_features = len(alone.descriptor.vertices)
    assert len(found.parts.features.vertices) == n_features + 70, (
        "each fragment is a region of its own"
    )
    assert found.parts.labels[: BODY.n_faces].tolist() == alone.parts.labels.tolist()
    assert found.parts.labels[BODY.n_faces :].min() == n_features


def test_specks_have_come_to_one_temperature():
    """1 over the area of each, as all of the heat that stays there says."""
    found = es.retrieval.find_heat_features(SPECKED, RECIPE)
    area = es.geometry.surface_area(moved(es.icosphere(0), 0.004, [0, 0, 0]))
    np.testing.assert_allclose(found.heat[800:], 1 / area, rtol=1e-6)
    laplacian = es.cotangent_laplacian(SPECKED)
    time = RECIPE.feature_scale * RECIPE.time_unit * es.geometry.surface_area(BODY)
    heat = es.heat_kernel_signature(es.solve_spectrum(laplacian, 110), [time])[:, 0]
    np.testing.assert_allclose(found.heat, heat, rtol=1e-6)


def test_forty_equal_parts_have_a_feature_each():
    found = es.retrieval.find_heat_features(SOUP, RECIPE)
    parts = np.sort(found.descriptor.vertices) // 42
    assert parts.tolist() == list(range(40))
    assert len(found.spectrum.eigenvalues) == RECIPE.n_modes + 39
    large = es.retrieval.find_heat_features(SOUP, RECIPE, accuracy=0.01)
    assert es.retrieval.matching_score(
        large.descriptor, found.descriptor
    ) < 0.05 * es.retrieval.matching_score(
        large.descriptor, es.retrieval.find_heat_features(BODY, RECIPE).descriptor
    )


def test_an_open_body_with_specks():
    """The boundary of fragments frees no heat of reflections: they are left out of both spectra."""
    half = es.scans.cut_by_planes(BODY, [[1, 0, 0, 0.1]]).mesh
    speck = es.TriangleMesh(0.01 * np.eye(3), [[0, 1, 2]])
    mesh = es.geometry.disjoint_union(half, *[moved(speck, 1, [2 + i, 0, 0]) for i in range(20)])
    alone, found = (
        es.retrieval.find_heat_features(half, RECIPE).descriptor,
        es.retrieval.find_heat_features(mesh, RECIPE).descriptor,
    )
    assert found.vertices.tolist() == alone.vertices.tolist()
    np.testing.assert_allclose(found.vectors, alone.vectors, rtol=1e-9)
    large = es.retrieval.find_heat_features(mesh, RECIPE, accuracy=0.01)
    assert es.retrieval.matching_score(large.descriptor, alone) < 1


def test_patches_are_spread_over_what_has_the_area_of_one():
    alone, found = surface_patches(BODY), surface_patches(SPECKED)
    for name in ("numbers", "weights", "vertices", "distances"):
        np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))
    many = surface_patches(SOUP)
    assert set((many.vertices // 42).tolist()) == set(range(40))
    assert np.isinf(many.distances).any(), "there is no way from one part to another"
    dusty = surface_patches(DUST)
    assert len(np.unique(dusty.vertices // 12)) == 150
    assert dusty.weights.sum(axis=0) == pytest.approx(np.ones(9))


@pytest.mark.parametrize("mesh", [SPECKED, SOUP, DUST], ids=["specked", "soup", "dust"])
def test_each_component_is_a_part_at_least(mesh):
    # At level 0 the specks change one part of the body, whose persistence is that of the cut.
    found = es.find_parts(mesh, level=-0.5)
    count, labels = es.geometry.vertex_components(mesh)
    owners = np.unique(np.column_stack([found.parts.labels, labels[mesh.faces[:, 0]]]), axis=0)
    assert len(np.unique(owners[:, 1])) == count
    assert len(owners) == len(found.parts.features.vertices), "no part has faces of two components"
    if mesh is SPECKED:
        alone = es.find_parts(BODY, level=-0.5)
        assert len(owners) == len(alone.parts.features.vertices) + 70


def test_views_of_a_shape_of_many_parts_show_many_and_those_of_a_body_one_piece():
    for view in views_of(SOUP, 3):
        n_pieces, labels = es.geometry.vertex_components(view.mesh)
        assert n_pieces >= 10
        assert len(np.unique(view.source_vertices // 42)) == n_pieces
        assert len(np.unique(labels)) == n_pieces
    for view in views_of(SPECKED, 2):
        assert es.geometry.vertex_components(view.mesh)[0] == 1


@pytest.mark.long
def test_a_scan_of_a_shape_of_many_parts_finds_it():
    """Rows of balls and of fish: neither is found by one of its parts alone."""
    fish = es.make_creature("fish", 0, n_vertices=500)
    length = np.ptp(fish.vertices, axis=0).max()
    shoal = [
        moved(fish, 2 / length, [3 * column, 3 * row, 0]) for column in range(5) for row in range(4)
    ]
    index = es.ShapeIndex.create(None)
    index.add("soup", SOUP, recipe=RECIPE, n_views=2)
    index.add("shoal", es.geometry.disjoint_union(*shoal), recipe=RECIPE, n_views=2)
    assert len(index.descriptors("shoal", RECIPE)[0].vertices) == 20
    for name, mesh in (("soup", SOUP), ("shoal", es.geometry.disjoint_union(*shoal))):
        scan = es.partial_scan(mesh, [0.2, 0.3, 1], all_pieces=True).mesh
        assert index.query(es.describe(scan, RECIPE))[0].name == name


@pytest.mark.long
@pytest.mark.parametrize(
    "recipe",
    [RECIPE, es.retrieval.PatchRecipe()],
    ids=["heat", "patches"],
)
def test_an_index_of_shapes_of_many_parts(tmp_path, recipe):
    shapes = {
        "specked": SPECKED,
        "soup": SOUP,
        "other": es.make_creature("bird", 0, n_vertices=800),
    }
    index = es.ShapeIndex.create(tmp_path / "index")
    for name, mesh in shapes.items():
        index.add(name, mesh, recipe=recipe, n_views=1)
    for name, mesh in (("specked", BODY), ("specked", SPECKED), ("soup", SOUP)):
        assert index.query(es.describe(mesh, recipe), n_matches=1)[0].name == name
