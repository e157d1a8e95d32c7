"""What a mesh must be, and that each remedy a message names helps."""

from functools import partial

import numpy as np
import pytest
from broken_meshes import (
    cut_open,
    flipped,
    soup,
    tetrahedra,
    with_duplicates,
    with_flat_simplices,
    with_loose_points,
)
from registered_operators import of_surfaces

from eigenshape._errors import InvalidShapeError
from eigenshape.features.parts import find_parts
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.curvature import gaussian_curvature
from eigenshape.geometry.distances.geodesic import average_geodesic_distance
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import REPAIRS, repair
from eigenshape.geometry.requirements import require_joined
from eigenshape.geometry.samples.quadrature import shape_quadrature
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.anisotropic import curvature_tensors
from eigenshape.operators.connection import connection_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian
from eigenshape.operators.graph import graph_laplacian
from eigenshape.operators.smoothing import noise_level
from eigenshape.retrieval.heat.features import find_heat_features
from eigenshape.retrieval.heat.recipe import SCALE_FREE
from eigenshape.retrieval.kinds import describe, describe_to_store
from eigenshape.retrieval.labels.labeled_shape import LabeledShape
from eigenshape.retrieval.labels.transfer import transfer_labels
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.patches.patches import extract_patches, surface_patches
from eigenshape.scans.partial import partial_scan, viewpoint
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.comparison.eigenvalues import shape_dna
from eigenshape.spectral.solve import solve_spectrum

BALL = icosphere(2)
OPERATORS = {
    **of_surfaces(),
    "crouzeix_raviart": crouzeix_raviart_laplacian,
    "connection": connection_laplacian,
    "brackets": lambda mesh: bracket_eigenvalues(mesh, 4),
    "quadrature": shape_quadrature,
    "gaussian_curvature": gaussian_curvature,
}
DESCRIBERS = {
    "find_heat_features": find_heat_features,
    "find_heat_features, approximately": partial(find_heat_features, accuracy=0.01),
    "describe by heat": lambda mesh: describe(mesh, SCALE_FREE),
    "describe by patches": describe,
    "describe_to_store by heat": lambda mesh: describe_to_store(mesh, SCALE_FREE, 1),
    "describe_to_store by patches": lambda mesh: describe_to_store(mesh, PatchRecipe(), 1),
    "surface_patches": surface_patches,
    "extract_patches": lambda mesh: extract_patches(mesh, n_views=1),
    "find_parts": find_parts,
    "transfer_labels": lambda mesh: transfer_labels(
        LabeledShape(BALL, np.zeros(BALL.n_faces, dtype=np.int64)), mesh
    ),
    "shape_dna": shape_dna,
    "average_geodesic_distance": average_geodesic_distance,
}


def rng():
    return np.random.default_rng(7)


def require_remedy(needs, mesh, fault):
    """A call is refused with a remedy, which lets it pass."""
    with pytest.raises(
        InvalidShapeError, match=fault + r".* Try repair\(mesh, \[\"auto\"\]\), or --repair auto"
    ):
        needs(mesh)
    needs(repair(mesh, ["auto"]).mesh)


@pytest.mark.parametrize("name", OPERATORS)
def test_a_face_does_not_count_twice(name):
    require_remedy(
        OPERATORS[name], with_duplicates(BALL, rng()), "Faces must differ, or they count twice; "
    )


def test_twenty_of_320_faces_do_not_move_eigenvalues():
    doubled = with_duplicates(BALL, np.random.default_rng(0), 20)
    with pytest.raises(
        InvalidShapeError, match=r"; faces 272 and 320 both have .* \[4, 64, 66\] \(20 such\)"
    ):
        cotangent_laplacian(doubled)
    found, expected = (
        solve_spectrum(cotangent_laplacian(mesh), 9).eigenvalues
        for mesh in (repair(doubled, ["auto"]).mesh, BALL)
    )
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", ["cotangent", "p2", "crouzeix_raviart", "brackets", "quadrature"])
def test_a_tetrahedron_does_not_count_twice(name):
    mesh = tetrahedra()
    require_remedy(
        OPERATORS[name],
        with_duplicates(mesh, rng(), 1),
        "Simplices must differ, or they count twice; ",
    )
    require_remedy(
        OPERATORS[name], with_loose_points(mesh, rng()), "Every point must belong to a simplex; "
    )
    require_remedy(
        OPERATORS[name], with_flat_simplices(mesh, rng()), "Tetrahedra must have volume; "
    )


@pytest.mark.long
@pytest.mark.parametrize("name", DESCRIBERS)
def test_a_soup_is_not_described(name):
    require_remedy(
        DESCRIBERS[name], soup(BALL), "Pieces that lie edge on edge must share their vertices; "
    )


@pytest.mark.long
@pytest.mark.parametrize("name", DESCRIBERS)
def test_what_hides_a_shape_has_one_remedy(name):
    require_remedy(
        DESCRIBERS[name], with_loose_points(BALL, rng(), 30), "Every vertex must belong to a face; "
    )
    require_remedy(
        DESCRIBERS[name], with_duplicates(BALL, rng()), "Faces must differ, or they count twice; "
    )
    require_remedy(DESCRIBERS[name], cut_open(BALL, rng()), "Pieces that lie edge on edge ")


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["describe by patches", "surface_patches", "find_parts", "transfer_labels"]
)
def test_what_looks_from_outside_needs_an_orientation(name):
    require_remedy(DESCRIBERS[name], flipped(BALL, rng()), "faces must be turned the same way; ")
    require_remedy(
        lambda mesh: curvature_tensors(mesh, 1.0),
        flipped(BALL, rng()),
        "faces must be turned the same way; ",
    )


def test_where_no_side_matters_none_is_asked_for():
    turned = flipped(BALL, rng())
    np.testing.assert_allclose(shape_dna(turned), shape_dna(BALL), rtol=1e-9)
    assert noise_level(turned) == pytest.approx(noise_level(BALL), rel=1e-12)
    seen = [partial_scan(mesh, viewpoint(1)).source_faces for mesh in (turned, BALL)]
    np.testing.assert_array_equal(*seen)


@pytest.mark.parametrize("kind", ["combinatorial", "weighted", "normalized"])
def test_graphs_of_flat_faces(kind):
    require_remedy(
        lambda mesh: graph_laplacian(mesh, kind),
        with_flat_simplices(BALL, rng()),
        "distinct corners; ",
    )
    points = np.concatenate([BALL.vertices, BALL.vertices[:1]])
    flat = TriangleMesh(points, [*BALL.faces, [0, len(points) - 1, 1]])
    if kind == "weighted":
        require_remedy(lambda mesh: graph_laplacian(mesh, kind), flat, "Edges must have length; ")


def test_copies_of_points():
    points = fibonacci_sphere(100).vertices
    cloud = PointCloud(np.concatenate([points, points[:3]]))
    with pytest.raises(
        InvalidShapeError, match=r"Points must differ; .* \(6 such\)\. Try repair\(cloud, "
    ):
        shape_quadrature(cloud)
    assert shape_quadrature(repair(cloud, ["auto"]).cloud).n_points == 100


def test_pieces_that_touch_without_a_seam_are_no_soup():
    far = TriangleMesh(BALL.vertices + 2 * BALL.vertices[0], BALL.faces)
    require_joined(disjoint_union(BALL, far))
    require_joined(disjoint_union(BALL, BALL))


def test_every_repair_takes_a_mesh():
    assert all(repair(BALL, [name]).mesh.n_faces == BALL.n_faces for name in REPAIRS)
