"""Every function of a shape answers in the unit of its coordinates, times the power of length that it is in.

Units are powers of two near a millionth and a million, in which all roundings are the same.
"""

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints

import numpy as np
import pytest
import scipy.sparse as sp
from laws.natural_slips import kinds
from public_names import public_things
from registered_operators import builders

import eigenshape as es
from eigenshape import calculus, deformation, geometry, operators, spectral, stability
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS

UNITS = (2.0**-20, 2.0**20)
TURN = es.Rotation([0, 0, 0], [1, 0, 0], 0.4)
VOXELS = np.arange(125).reshape(5, 5, 5) % 3 == 1


class Shapes:
    """Some shapes in a unit `u`."""

    def __init__(self, u: float) -> None:
        ball, flat = es.icosphere(2), es.shapes.grid(9, 7)
        x, y, z = ball.vertices.T
        radius = 1 + 0.3 * x * y + 0.2 * z**3 + 0.1 * np.sin(3 * x + y)
        body = ball.vertices * [1.0, 1.3, 0.8] * radius[:, None]
        self.u = u
        self.mesh = es.TriangleMesh(u * body, ball.faces)
        self.other = es.TriangleMesh(u * (body + 0.01 * np.sin(body[:, ::-1])), ball.faces)
        self.sheet = es.TriangleMesh(
            u * (flat.vertices + [0, 0, 1] * np.sin(2 * flat.vertices[:, :1])), flat.faces
        )
        solid = es.shapes.box(3, 3, 3)
        self.solid = es.SimplicialMesh(u * solid.points, solid.simplices)
        self.cloud = es.PointCloud(u * es.icosphere(3).vertices, 2)
        self.laplacian = es.cotangent_laplacian(self.mesh)
        self.spectrum = es.solve_spectrum(self.laplacian, 30)
        self.f = np.sin(3 * body[:, 0]) + body[:, 1]  # without unit
        self.on_sheet = flat.vertices[:, 0] ** 2
        self.slopes = calculus.gradient(self.mesh, self.f)
        self.times = u**2 * np.array([0.05, 0.5])
        self.rig = es.rig_shape(self.mesh)
        self.region = deformation.BoxRegion(u * np.array([-9, 0.4, -9]), u * np.full(3, 9.0))


# The power of length that an answer is in, and the call. Parts of an answer in several powers are
# several rows.
LAWS: dict[str, tuple[int, Callable[[Shapes], Any]]] = {
    "align_surfaces": (0, lambda s: es.collections.align_surfaces(s.mesh, s.other).rotation),
    "angle_distortion": (0, lambda s: calculus.angle_distortion(s.mesh, s.other.vertices)),
    "anisotropic_laplacian": (
        0,
        lambda s: (
            operators.anisotropic_laplacian(
                s.mesh, operators.curvature_tensors(s.mesh, 1.0)
            ).stiffness
        ),
    ),
    "apply_heat": (0, lambda s: spectral.apply_heat(s.laplacian, s.f, s.times[0])),
    "average_geodesic_distance": (
        1,
        lambda s: geometry.average_geodesic_distance(s.mesh, n_bases=162),
    ),
    "average_onto_points": (-1, lambda s: calculus.average_onto_points(s.mesh, s.slopes)),
    "boundary_load": (1, lambda s: calculus.boundary_load(s.sheet, s.on_sheet)),
    "bracket_eigenvalues": (-2, lambda s: es.bracket_eigenvalues(s.mesh, 5).lower),
    "closest_points": (1, lambda s: geometry.closest_points(s.mesh, s.other.vertices).points),
    "cloud_width": (1, lambda s: operators.cloud_width(s.cloud)),
    "compare_shapes": (
        0,
        lambda s: (
            es.compare_shapes(
                s.mesh, s.other, stability.StabilityPlan(k=5, n_samples=100)
            ).spectra.relative
        ),
    ),
    "connection_laplacian": (0, lambda s: operators.connection_laplacian(s.mesh).stiffness),
    "cotangent_laplacian": (2, lambda s: es.cotangent_laplacian(s.mesh).mass),
    "crouzeix_raviart_laplacian": (2, lambda s: operators.crouzeix_raviart_laplacian(s.mesh).mass),
    "curl": (0, lambda s: calculus.curl(s.mesh, s.slopes)),
    "curl, matrix": (1, lambda s: calculus.curl(s.mesh)),
    "curvature_tensors": (0, lambda s: operators.curvature_tensors(s.mesh, 1.0)),
    "cut_by_planes": (
        1,
        lambda s: es.scans.cut_by_planes(s.mesh, [[0.0, 1.0, 0.0, 0.3 * s.u]]).mesh,
    ),
    "decompose_field": (0, lambda s: calculus.decompose_field(s.mesh, s.slopes).potential),
    "denoise": (1, lambda s: operators.denoise(s.mesh)),
    "disjoint_union": (1, lambda s: geometry.disjoint_union(s.mesh, s.other)),
    "divergence": (0, lambda s: calculus.divergence(s.mesh, s.slopes)),
    "divergence, matrix": (1, lambda s: calculus.divergence(s.mesh)),
    "dual_volumes": (2, lambda s: geometry.dual_volumes(s.mesh)),
    "edge_lengths": (1, lambda s: geometry.edge_lengths(s.mesh)),
    "enclosed_volume": (3, lambda s: geometry.enclosed_volume(s.mesh)),
    "extend_scalar": (
        0,
        lambda s: calculus.extend_scalar(calculus.prepare_vector_heat(s.mesh), [0, 9], [1.0, 5.0]),
    ),
    "face_areas": (2, lambda s: geometry.face_areas(s.mesh)),
    "face_normals": (0, lambda s: geometry.face_normals(s.mesh)),
    "farthest_points": (0, lambda s: geometry.farthest_points(s.mesh, 9)[0]),
    "fem_laplacian": (3, lambda s: operators.fem_laplacian(s.solid, 2).mass),
    "fem_nodes": (1, lambda s: operators.fem_nodes(s.solid, 2)),
    "fit_surface": (1, lambda s: es.collections.fit_surface(s.mesh, s.other).vertices),
    "flatten_conformally": (1, lambda s: calculus.flatten_conformally(s.sheet)),
    "functional_map": (
        0,
        lambda s: (
            es.functional_map(
                s.spectrum, s.spectrum, n_modes=8, descriptors="waves", meshes=(s.mesh, s.mesh)
            ).matrix
        ),
    ),
    "gaussian_curvature": (-2, lambda s: geometry.gaussian_curvature(s.mesh)),
    "geodesic_distances": (1, lambda s: geometry.geodesic_distances(s.mesh, [0, 9, [3, 5]])),
    "geodesic_path": (1, lambda s: calculus.geodesic_path(s.mesh, 0, 99).points),
    "gradient": (-1, lambda s: s.slopes),
    "gradient, matrix": (-1, lambda s: calculus.gradient(s.mesh)),
    "harmonic_fields": (0, lambda s: len(calculus.harmonic_fields(s.mesh).T)),
    "heat_distances": (1, lambda s: calculus.heat_distances(s.mesh, [0, 9, [3, 5]])),
    "level_set": (1, lambda s: calculus.level_set(s.mesh, s.f, 0.1).points),
    "logarithmic_map": (1, lambda s: calculus.logarithmic_map(s.mesh, 0)),
    "map_to_sphere": (0, lambda s: calculus.map_to_sphere(s.mesh)),
    "match_shapes": (0, lambda s: es.match_shapes(s.mesh, s.other).weights),
    "mean_curvature": (-1, lambda s: operators.mean_curvature(s.mesh)),
    "mean_curvature_flow": (1, lambda s: calculus.mean_curvature_flow(s.mesh, s.times[0] / 9)),
    "mean_side_length": (1, lambda s: geometry.mean_side_length(s.mesh)),
    "measure_distortion": (0, lambda s: deformation.measure_distortion(s.mesh, s.other)),
    "merge_tree": (0, lambda s: es.merge_tree(s.mesh, s.f).values),
    "mesh_laplacian": (2, lambda s: es.mesh_laplacian(s.mesh).mass),
    "shape_quadrature": (2, lambda s: geometry.shape_quadrature(s.mesh).weights),
    "nodal_set": (1, lambda s: spectral.nodal_set(s.mesh, s.f).points),
    "noise_level": (0, lambda s: operators.noise_level(s.mesh)),
    "normalize_mesh": (0, lambda s: geometry.normalize_mesh(s.mesh, "box")),
    "normalize_mesh, area": (0, lambda s: geometry.normalize_mesh(s.mesh, "area")),
    "normalize_mesh, diameter": (0, lambda s: geometry.normalize_mesh(s.mesh, "diameter")),
    "operator_bundle": (-2, lambda s: spectral.operator_bundle(s.mesh, 5).eigenvalues[1:]),
    "part_tree": (0, lambda s: es.features.part_tree(s.mesh, s.spectrum).basins),
    "find_parts": (0, lambda s: es.find_parts(s.mesh).parts.labels),
    "partial_scan": (1, lambda s: es.partial_scan(s.mesh, [0, 0, 1], resolution=60).mesh),
    "persistence_diagram": (0, lambda s: es.features.persistence_diagram(s.mesh, s.f).maxima),
    "pointwise_time": (2, lambda s: operators.pointwise_time(s.mesh)),
    "polyharmonic_matrix": (-4, lambda s: calculus.polyharmonic_matrix(s.laplacian, 3)),
    "prepare_heat_geodesics": (
        1,
        lambda s: calculus.heat_distances(calculus.prepare_heat_geodesics(s.mesh), [5]),
    ),
    "prepare_vector_heat": (
        0,
        lambda s: calculus.transport_vectors(
            calculus.prepare_vector_heat(s.mesh), [0, 9], np.eye(2)
        ),
    ),
    "principal_curvatures": (-1, lambda s: geometry.principal_curvatures(s.mesh).values),
    "register_scans": (0, lambda s: es.matching.register_scans(s.mesh, s.mesh).rotation),
    "remove_means": (0, lambda s: calculus.remove_means(s.laplacian, s.f)),
    "replay": (
        1,
        lambda s: (
            deformation.replay(s.rig, [deformation.Edit((deformation.Move(s.region, TURN),))]).mesh
        ),
    ),
    "sample_surface": (
        1,
        lambda s: geometry.sample_surface(s.mesh, 50, rng=np.random.default_rng(0)).points,
    ),
    "shape_dna": (0, lambda s: spectral.shape_dna(s.mesh, 9)),
    "signed_distance": (1, lambda s: geometry.signed_distance(s.mesh, s.other.vertices)),
    "signed_heat_distance": (
        1,
        lambda s: calculus.signed_heat_distance(
            calculus.prepare_vector_heat(s.mesh), [s.mesh.faces[0, [0, 1, 2, 0]]]
        ),
    ),
    "simplex_volumes": (3, lambda s: geometry.simplex_volumes(s.solid)),
    "smooth_mesh": (
        1,
        lambda s: spectral.smooth_mesh(s.mesh, s.spectrum, lambda each: np.exp(-s.times[0] * each)),
    ),
    "solve_harmonic": (
        0,
        lambda s: np.stack(
            [
                calculus.solve_harmonic(s.laplacian, [0, 9], [1.0, 2.0], order=order)
                for order in (1, 2, 3)
            ]
        ),
    ),
    "solve_heat": (0, lambda s: calculus.solve_heat(s.laplacian, s.f, s.times[0], n_steps=3)),
    "solve_helmholtz": (
        2,
        lambda s: calculus.solve_helmholtz(s.laplacian, -1 / s.u**2, s.f),
    ),
    "solve_poisson": (2, lambda s: calculus.solve_poisson(s.laplacian, s.f, fixed=[0])),
    "solve_spectrum": (-2, lambda s: s.spectrum.eigenvalues[1:]),
    "subdivide": (1, lambda s: geometry.subdivide(s.mesh)),
    "surface_area": (2, lambda s: geometry.surface_area(s.mesh)),
    "take_pose": (1, lambda s: es.matching.take_pose(s.mesh, s.other)),
    "tangent_frames": (0, lambda s: operators.tangent_frames(s.mesh)),
    "taubin_smooth": (1, lambda s: calculus.taubin_smooth(s.mesh)),
    "trace_geodesic": (
        1,
        lambda s: calculus.trace_geodesic(s.mesh, 0, s.u * np.array([0.4, 0.2])).points,
    ),
    "transfer_deformation": (
        1,
        lambda s: deformation.transfer_deformation(
            s.mesh,
            s.other,
            s.mesh,
            spectral.map_from_points(s.spectrum, s.spectrum, np.arange(162), n_modes=12),
        ),
    ),
    "vertex_normals": (0, lambda s: geometry.vertex_normals(s.mesh)),
    "compare_spectra": (0, lambda s: spectral.compare_spectra(s.spectrum, s.spectrum).relative),
    "resample_curves": (
        1,
        lambda s: (
            es.morphometrics.resample_curves(
                es.morphometrics.Landmarks(
                    "abc", s.mesh.vertices[s.mesh.faces[0]], curves=[[0, 1, 2, 0]]
                ),
                9,
                mesh=s.mesh,
            ).points
        ),
    ),
    "warp_mesh": (
        1,
        lambda s: (
            es.morphometrics.warp_mesh(
                s.mesh, s.mesh.vertices[::20], s.other.vertices[::20]
            ).vertices
        ),
    ),
    "winding_numbers": (0, lambda s: geometry.winding_numbers(s.mesh, s.other.vertices)),
    "anchor_nodes": (1, lambda s: stability.anchor_nodes(s.mesh, 0.5 * s.u).points),
    "approximate_heat_signature": (
        -2,
        lambda s: spectral.approximate_heat_signature(s.laplacian, 8, s.times).values,
    ),
    "boundary_surface": (1, lambda s: geometry.boundary_surface(s.solid)),
    "build_laplacian": (2, lambda s: es.build_laplacian(s.mesh, "cotangent").mass),
    "cheeger_estimate": (-1, lambda s: stability.cheeger_estimate(s.mesh, s.spectrum).upper),
    "shape_quadrature, cloud": (2, lambda s: geometry.shape_quadrature(s.cloud).weights),
    "dirichlet_laplacian": (2, lambda s: operators.dirichlet_laplacian(s.laplacian, [0])[0].mass),
    "embed_watermark": (1, lambda s: spectral.embed_watermark(s.mesh, "a key", k=30)),
    "extract_patches": (
        0,
        lambda s: es.retrieval.extract_patches(s.mesh, n_views=0)[0].weights,
    ),
    "find_heat_features": (0, lambda s: es.retrieval.find_heat_features(s.mesh).parts.labels),
    "geodesic_balls": (1, lambda s: geometry.geodesic_balls(s.mesh, 0.4 * s.u)),
    "geodesic_waves": (1, lambda s: geometry.geodesic_waves(s.mesh)(0, s.u)[1]),
    "mask_surface": (1, lambda s: geometry.mask_surface(s.mesh, s.f > s.f.mean()).mesh),
    "brain_print": (0, lambda s: es.modes.brain_print({"lh": s.mesh}, 8).values),
    "condense": (2, lambda s: es.features.condense(s.mesh, s.f).areas),
    "structure_surfaces": (
        1,
        lambda s: es.modes.structure_surfaces(VOXELS, np.diag([s.u, s.u, s.u, 1]), {"a": 1})["a"],
    ),
    "voxel_surface": (
        1,
        lambda s: calculus.voxel_surface(VOXELS, np.diag([s.u, s.u, s.u, 1])),
    ),
    "parcellate": (
        0,
        lambda s: es.features.parcellate(
            s.mesh, s.f, es.features.Parcellation((s.f > s.f.mean()).astype(int))
        ),
    ),
    "orient_outward": (1, lambda s: geometry.orient_outward(s.mesh)),
    "random_planes": (
        1,
        lambda s: es.scans.random_planes(s.mesh, np.random.default_rng(0))[:, 3],
    ),
    "decimate": (1, lambda s: es.geometry.decimate(s.mesh, ratio=0.5).mesh),
    "tetrahedralize": (1, lambda s: geometry.tetrahedralize(s.mesh).points),
    "repair": (
        1,
        lambda s: np.concatenate(
            [es.repair(s.mesh, [name]).mesh.vertices for name in MESH_REPAIRS]
            + [es.repair(s.sheet, ["fill_holes"]).mesh.vertices]
        ),
    ),
    "rig_shape": (1, lambda s: es.deform(s.rig, s.region, TURN)),
    "transport_vectors": (
        0,
        lambda s: calculus.transport_vectors(
            calculus.prepare_vector_heat(s.mesh), [0, 9], np.eye(2)
        ),
    ),
    "weyl_bound": (
        -2,
        lambda s: stability.weyl_bound(s.laplacian, es.cotangent_laplacian(s.other)).norm,
    ),
}


def law_of_operator(entry: es.operators.Operator) -> tuple[int, Callable[[Shapes], Any]]:
    """Return the law of a registered operator: its eigenvalues are in 1/length²."""

    def eigenvalues(s: Shapes) -> np.ndarray:
        shape = next(each for each in (s.mesh, s.solid, s.cloud) if isinstance(each, entry.shapes))
        return es.solve_spectrum(entry.build(shape), 5).eigenvalues[1:]

    return -2, eigenvalues


for _name, _entry in builders().items():
    LAWS.setdefault(_name, law_of_operator(_entry))

# Functions of a shape whose answer has no number with a unit: relations of points and faces, lists
# of vertices, pictures, files, proofs, and estimates that are compared with a model of the unit.
WITHOUT = {
    "adjacent_parts",
    "aim_camera",
    "betti_numbers",
    "boundary_edges",
    "boundary_loops",
    "boundary_vertices",
    "certify",
    "check_laplacian",
    "check_operator",
    "decompose_one_form",
    "describe",
    "detect_watermark",
    "draw",
    "draw_thumbnail",
    "edge_graph",
    "edge_table",
    "eigenspace_angles",
    "euler_characteristic",
    "facet_table",
    "fem_boundary_nodes",
    "figure_cortex",
    "figure_eigenfunctions",
    "figure_field",
    "figure_fields",
    "figure_label_transfer",
    "figure_match",
    "figure_matches",
    "figure_poses",
    "figure_segments",
    "figure_stability",
    "graph_laplacian",
    "is_closed",
    "is_manifold",
    "labels_from_votes",
    "local_triangles",
    "measure_perturbation",
    "nodal_domains",
    "nodal_parcels",
    "normalized_cut",
    "one_form_edges",
    "part_colors",
    "query_indexes",
    "read_edits",
    "read_parcellation",
    "region_boundary",
    "region_mask",
    "self_intersections",
    "simulate_scan",
    "smooth_boundaries",
    "suggest_repairs",
    "to_pyvista",
    "to_trimesh",
    "transfer",
    "transfer_labels",
    "vertex_components",
    "view",
    "write_edits",
    "write_mesh",
    "write_parcellation",
    "write_points",
}
# Others that are the same code as a row above, or have laws of the unit of their own.
ELSEWHERE = {
    "build_collection",
    "compress_mesh",
    "fuse_scans",
    "prepare_target",
    "carry_attributes",
    "write_fields",
}


def numbers(value: Any) -> np.ndarray:
    """Return the numbers of an answer: points of a shape, entries of a matrix."""
    if sp.issparse(value):
        return value.toarray()
    if isinstance(value, es.TriangleMesh | es.SimplicialMesh):
        return value.points
    if is_dataclass(value):
        value = [getattr(value, part.name) for part in fields(value)]
        return np.concatenate([np.ravel(numbers(part)) for part in value])
    return np.asarray(value, dtype=float)


@pytest.fixture(scope="module")
def shapes():
    return [Shapes(u) for u in (1.0, *UNITS)]


@pytest.mark.parametrize("name", LAWS)
def test_an_answer_is_in_the_unit_of_the_shape(shapes, name):
    power, call = LAWS[name]
    one, *others = (numbers(call(each)) for each in shapes)
    assert one.size
    least = 1e-9 * np.abs(one).max()
    for u, other in zip(UNITS, others, strict=True):
        np.testing.assert_allclose(other / u**power, one, rtol=1e-6, atol=least)


def test_every_function_of_a_shape_has_a_row_or_a_reason():
    shapes = {es.TriangleMesh, es.SimplicialMesh, es.PointCloud, es.Laplacian}
    found = set()
    for name, function in public_things().items():
        if inspect.isfunction(function):
            hints = get_type_hints(function)
            hints.pop("return", None)
            if any(kind in shapes for hint in hints.values() for kind in kinds(hint)):
                found.add(name)
    assert sorted(found - LAWS.keys() - WITHOUT - ELSEWHERE) == []
    assert sorted((WITHOUT | ELSEWHERE) - found) == []
