"""Regions in several patches: each follows the handle of its region, or is named."""

import warnings

import numpy as np
import pytest
from bent_shapes import lump_rig, tube

from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import deform
from eigenshape.deformation.handles import Translation
from eigenshape.deformation.region import BrushRegion, region_boundary, region_mask
from eigenshape.deformation.region_patches import regions_of_patches, split_region
from eigenshape.deformation.rig import rig_shape
from eigenshape.geometry.distances.geodesic import geodesic_distances
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.shapes.surfaces import icosphere

LIFT = Translation([0.0, 0.0, 0.3])


def split(mesh, mask):
    """Return the vertices of each patch, and the islands of each."""
    (distances,) = geodesic_distances(mesh, [region_boundary(mesh, mask)])
    found = split_region(mesh, mask, distances)
    return [patch.members.tolist() for patch in found], [patch.islands.tolist() for patch in found]


def discs(mesh, centers, radii):
    """Return a mask of each disc."""
    pairs = zip(centers, radii, strict=True)
    return [region_mask(mesh, BrushRegion(mesh.vertices[at], radius)) for at, radius in pairs]


def motions(rig, mask, **options):
    """Return the displacement of each vertex when the region is lifted."""
    bent = deform(rig, mask, LIFT, **options)
    return bent.vertices - rig.mesh.vertices


@pytest.mark.data
def test_four_fingertips_move_alike(data):
    mesh = read_mesh(data / "everyday" / "F_hand.ply")
    y = mesh.vertices[:, 1]
    mask = y >= y.min() + 0.8 * np.ptp(y)
    moved = motions(rig_shape(mesh), mask)
    tips, _ = split(mesh, mask)
    assert sorted(map(len, tips)) == [59, 92, 99, 108]
    for tip in tips:
        assert moved[tip, 2].max() == pytest.approx(0.3, rel=0.02)
        assert moved[tip, 2].mean() > 0.24
    wrist = y < y.min() + 0.3 * np.ptp(y)
    np.testing.assert_allclose(moved[wrist], 0, atol=1e-4)


@pytest.mark.parametrize("options", [{}, {"n_modes": 20}, {"fixed": [51]}])
def test_patches_of_all_sizes_follow_exactly(options):
    rig = lump_rig()
    centers, radii = [451, 164, 514, 330, 363], [0.6, 0.4, 0.3, 0.02, 0.02]
    each = discs(rig.mesh, centers, radii)
    assert [int(disc.sum()) for disc in each[-2:]] == [1, 1]
    moved = motions(rig, np.any(each, axis=0), **options)
    for disc in each:
        errors = np.linalg.norm(moved[disc] - LIFT.vector, axis=1)
        assert errors.min() < 1e-15


def test_a_region_of_one_patch_is_bound_as_ever():
    """The patch is the region: its vertices, and the bend up to half of its depth."""
    mesh = tube()
    row = np.arange(mesh.n_vertices) // 12
    (distances,) = geodesic_distances(mesh, [region_boundary(mesh, row >= 30)])
    (patch,) = split_region(mesh, row >= 30, distances)
    assert patch.members.tolist() == np.flatnonzero(row >= 30).tolist()
    assert patch.islands.tolist() == []
    assert patch.extent == pytest.approx(10 / 30, rel=1e-9)
    assert set(row[patch.bend].tolist()) == set(range(26, 35))  # less than 5 rows away
    assert regions_of_patches(mesh, [7]) == [[7]]


def test_each_patch_has_its_own_number_of_modes():
    """The largest number counts for the region: 300 for a single vertex, 50 for the disc alone."""
    rig = lump_rig()
    disc, vertex = discs(rig.mesh, [451, 164], [0.6, 0.02])
    assert bind(rig, [disc]).n_modes.tolist() == [50]
    assert bind(rig, [disc | vertex]).n_modes.tolist() == [300]
    alone, both = bind(rig, [disc]).shares[0], bind(rig, [disc | vertex]).shares[0]
    np.testing.assert_allclose(alone[disc], both[disc], atol=0.03)


def test_islands_in_the_bend_beside_a_patch_follow_as_its_boundary_does():
    """A box cuts them off a rough surface; if they followed exactly, they would stick out."""
    rig = lump_rig()
    x = rig.mesh.vertices[:, 0]
    main = x > 0.6
    away = geodesic_distances(rig.mesh, [np.flatnonzero(main)])[0]
    island = np.flatnonzero((away > 0.2) & (away < 0.3))[[0]]
    mask = main.copy()
    mask[island] = True
    patches, islands = split(rig.mesh, mask)
    assert len(patches) == 1
    assert islands == [island.tolist()]
    message = rf"follow in part: 1 vertex, of which vertex {island[0]} follows by 0\.\d\d\. Leave"
    with pytest.warns(UserWarning, match=message):
        moved = motions(rig, mask)
    beside = (away > 0.15) & (away < 0.35)
    assert moved[beside, 2].min() <= moved[island, 2][0] <= moved[beside, 2].max() < 0.2
    # The remedies: without the island, and with all that is as near to the patch.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bind(rig, [main])
        bind(rig, [away < 0.3])


def test_patches_on_components_of_different_sizes_follow():
    """The modes of a small component are few among the lowest of all."""
    small = icosphere(2)
    small = TriangleMesh(small.vertices * 0.05 + [3.0, 0, 0], small.faces)
    mesh = disjoint_union(icosphere(3), small, icosphere(1))
    place = np.repeat([0, 1, 2], [642, 162, 42])
    rig = rig_shape(mesh)
    tops = [(place == 0) & (mesh.vertices[:, 2] > 0.5), (place == 1) & (mesh.vertices[:, 2] > 0.02)]
    whole = place == 2
    moved = motions(rig, tops[0] | tops[1] | whole)
    for top in tops:
        assert np.linalg.norm(moved[top] - LIFT.vector, axis=1).min() < 1e-15
    np.testing.assert_allclose(moved[whole] - LIFT.vector, 0, atol=1e-15)
    # The lower half of the small component stays, although no mode of the rig may be on it alone.
    assert np.abs(moved[(place == 1) & (mesh.vertices[:, 2] < -0.04)]).max() < 0.15


def test_a_region_follows_its_own_handle_beside_another_one():
    rig = lump_rig()
    near = discs(rig.mesh, [100, 140], [0.25, 0.25])
    near[1] &= ~near[0]
    shares = bind(rig, near).shares
    for number, disc in enumerate(near):
        exact = disc & (shares[number] == 1)
        assert exact.any()
        np.testing.assert_array_equal(shares[1 - number, exact], 0)


def test_whole_components_go_with_the_nearest_patch():
    """A ring on each of two hands: each turns with its hand."""
    ball, ring = icosphere(2), icosphere(0)
    shapes = [TriangleMesh(ball.vertices + np.array([at, 0, 0]), ball.faces) for at in (0.0, 5.0)]
    shapes += [TriangleMesh(ring.vertices * 0.1 + [at, 0, 1.5], ring.faces) for at in (5.0, 0.0)]
    mesh = disjoint_union(*shapes)
    one, two = regions_of_patches(mesh, mesh.vertices[:, 2] > 0.5)
    for part, rings in ((one, range(336, 348)), (two, range(324, 336))):
        assert set(part[part >= 324].tolist()) == set(rings)
        assert np.ptp(mesh.vertices[part, 0]) < 2
