"""eigenshape hears the shape of things.

A shape of any dimension gives a Laplacian, the Laplacian a certified spectrum, the spectrum heat, heat the features
that persist, and features an answer to the question which shapes are alike.
"""

import importlib.metadata

from eigenshape._errors import (
    ConvergenceError,
    EigenshapeError,
    FileFormatError,
    InvalidParameterError,
    InvalidShapeError,
    MissingExtraError,
    StoreError,
)
from eigenshape.deformation.binding import Binding, bind
from eigenshape.deformation.deform import bend, deform
from eigenshape.deformation.distortion import Distortion, measure_distortion
from eigenshape.deformation.edits import Edit, Move, apply_edit
from eigenshape.deformation.handles import Rotation, Translation, rotation_by_drag
from eigenshape.deformation.peers import as_rigid_as_possible, biharmonic_blend, spectral_rigid
from eigenshape.deformation.region import Box, Brush, region_boundary, region_mask
from eigenshape.deformation.rig import EigenRig, eigen_skeleton, rig_shape
from eigenshape.deformation.session import DeformationSession, replay
from eigenshape.deformation.skeleton import SkeletonGrip, grip_skeleton, moved_skeleton
from eigenshape.deformation.thesis import DetailedSkeleton, detail_skeleton, eigen_deformed
from eigenshape.deformation.transfer import transfer_deformation
from eigenshape.features.bottleneck import bottleneck_distance
from eigenshape.features.boundaries import smooth_boundaries
from eigenshape.features.diagram import PersistenceDiagram, PersistencePairs, persistence_diagram
from eigenshape.features.merge_tree import MergeTree, merge_tree
from eigenshape.features.part_merging import part_tree
from eigenshape.features.part_tree import PartTree
from eigenshape.features.parts import PART_CONTRAST, FoundParts, find_parts, part_spectrum
from eigenshape.features.segmentation import FeaturePoints, Segmentation, merge_targets, segment, touching_parts
from eigenshape.geometry.average_distance import average_geodesic_distance
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.cloud_measure import cloud_quadrature
from eigenshape.geometry.conversion import MeshLike, ShapeLike, as_mesh, as_shape, from_arrays
from eigenshape.geometry.crossings import self_intersections
from eigenshape.geometry.curvature import gaussian_curvature
from eigenshape.geometry.enclosing_ball import Ball, enclosing_ball
from eigenshape.geometry.facets import FacetTable, boundary_surface, facet_table
from eigenshape.geometry.geodesic import (
    farthest_points,
    geodesic_balls,
    geodesic_distance_to_set,
    geodesic_distances,
)
from eigenshape.geometry.measure import (
    edge_lengths,
    enclosed_volume,
    face_areas,
    face_normals,
    surface_area,
    vertex_normals,
)
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.normalize import normalize_area, normalize_box, normalize_diameter
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.quadrature import (
    Quadrature,
    mesh_quadrature,
    sphere_quadrature,
    torus_quadrature,
    uniform_quadrature,
)
from eigenshape.geometry.repair import (
    Repaired,
    RepairedCloud,
    collapse_needles,
    drop_copies,
    drop_degenerate,
    drop_duplicate_faces,
    drop_unreferenced,
    largest_component,
    orient,
    repair,
    seal_holes,
    suggest_repairs,
    weld,
    weld_seams,
)
from eigenshape.geometry.simplices import dual_volumes, mean_side_length, simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.surface_points import SurfacePoints, sample_surface
from eigenshape.geometry.topology import (
    EdgeTable,
    boundary_edges,
    boundary_loops,
    boundary_vertices,
    edge_table,
    euler_characteristic,
    is_closed,
    is_manifold,
    vertex_components,
)
from eigenshape.io.bridges import from_pyvista, from_trimesh, to_arrays, to_pyvista, to_trimesh
from eigenshape.io.edits import read_edits, write_edits
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.io.shape_files import read_points, read_shape, write_points
from eigenshape.operators.anisotropic import anisotropic_laplacian, curvature_tensors
from eigenshape.operators.boundary import dirichlet_laplacian
from eigenshape.operators.catalog import OPERATORS, Operator, build_laplacian
from eigenshape.operators.connection import connection_laplacian, tangent_frames
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian
from eigenshape.operators.curvature import mean_curvature
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian, fem_nodes
from eigenshape.operators.gaussian import (
    functional_laplacian,
    gaussian_laplacian,
    mesh_laplacian,
    point_cloud_laplacian,
    quadrature_laplacian,
)
from eigenshape.operators.graph import edge_graph, graph_laplacian
from eigenshape.operators.laplacian import GaussianKernel, Laplacian
from eigenshape.operators.neighbors import neighbor_graph
from eigenshape.operators.robust import robust_laplacian
from eigenshape.operators.smoothing import denoise, noise_level
from eigenshape.plot.camera import Camera, three_quarter_view
from eigenshape.plot.fields import (
    figure_eigenfunctions,
    figure_field,
    figure_segments,
    part_colors,
    value_colors,
)
from eigenshape.plot.persistence import figure_diagram, figure_merge_tree
from eigenshape.plot.poses import figure_poses
from eigenshape.plot.save import save_figure
from eigenshape.plot.sheet import Panel, figure_contact_sheet, figure_label_transfer
from eigenshape.plot.spectra import figure_spectra, figure_spectrum
from eigenshape.plot.stability import figure_stability
from eigenshape.retrieval.baselines.affinity import affinity_distance, affinity_eigenvalues
from eigenshape.retrieval.baselines.light_field import light_field, light_field_distance
from eigenshape.retrieval.baselines.shape_dna import shape_dna, shape_dna_distance
from eigenshape.retrieval.heat.describe import DescribedShape, describe, describe_mesh, describe_views
from eigenshape.retrieval.heat.describe_large import DescribedLargeShape, describe_large_mesh
from eigenshape.retrieval.heat.descriptor import SCALE_FREE, THESIS, Recipe, ShapeDescriptor
from eigenshape.retrieval.heat.score import match_features, matching_score
from eigenshape.retrieval.label_transfer import LabelTransfer, transfer_labels
from eigenshape.retrieval.patches.codebook import (
    PatchCodebook,
    encode_patches,
    made_codebook,
    read_codebook,
    train_codebook,
    write_codebook,
)
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, PatchRecipe, in_words, seen_patches
from eigenshape.retrieval.patches.distance import patch_distances, view_distances
from eigenshape.retrieval.patches.matching import PatchMatch, PatchPoints, match_patches, patch_points
from eigenshape.retrieval.patches.patches import Patches, describe_patch_views, describe_patches
from eigenshape.retrieval.patches.verification import patch_scores, word_distances
from eigenshape.retrieval.store.batch import BatchReport, build_index, learn_words
from eigenshape.retrieval.store.index import Match, Record, ShapeIndex
from eigenshape.retrieval.store.kinds import describe_shape, describe_to_keep
from eigenshape.retrieval.store.workers import Item, Workers
from eigenshape.scans.depth_camera import DepthCamera, DepthScan, simulate_scan
from eigenshape.scans.partial import MeshPart, cut_by_planes, partial_scan, random_planes
from eigenshape.shapes.creatures import CREATURES, make_creature
from eigenshape.shapes.domains import ball, box, circle, disc, interval, irregular_grid
from eigenshape.shapes.exact import (
    ball_eigenvalues,
    box_eigenvalues,
    disc_eigenvalues,
    flat_torus_eigenvalues,
    projective_plane_eigenvalues,
    sphere_eigenvalues,
    sphere_functional_eigenvalues,
)
from eigenshape.shapes.harmonics import sphere_harmonics
from eigenshape.shapes.spheres import (
    fibonacci_sphere,
    graded_sphere,
    projective_plane,
    random_sphere,
    sphere_hull,
    three_sphere,
)
from eigenshape.shapes.surfaces import disjoint_union, grid, icosphere, subdivide, torus
from eigenshape.spectral.bounds.brackets import Brackets, bracket_eigenvalues
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.comparison.angles import EigenspaceAngles, eigenspace_angles
from eigenshape.spectral.comparison.eigenspaces import eigenspace_errors, separated_groups
from eigenshape.spectral.comparison.spectra import SpectrumComparison, compare_spectra, spectral_hausdorff_distance
from eigenshape.spectral.laws.laplacian_laws import check_laplacian
from eigenshape.spectral.laws.operator_laws import check_operator
from eigenshape.spectral.laws.report import USUAL, Law, NotJudged, OperatorReport
from eigenshape.spectral.maps.functional_map import FunctionalMap, compose_maps, functional_map, transfer_function
from eigenshape.spectral.maps.point_maps import map_from_points, point_map, refine_map
from eigenshape.spectral.multilevel.approximate import approximate_spectrum
from eigenshape.spectral.signatures.approximate_heat import ApproximateSignature, approximate_heat_kernel_signature
from eigenshape.spectral.signatures.heat import (
    default_times,
    heat_kernel_signature,
    reflection_free_signature,
    scale_invariant_heat_kernel_signature,
)
from eigenshape.spectral.signatures.wave import default_energies, wave_kernel_signature
from eigenshape.spectral.solver.certify import certify
from eigenshape.spectral.solver.dirichlet import solve_dirichlet
from eigenshape.spectral.solver.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum
from eigenshape.stability.anchors import AnchorNodes, anchor_nodes, anchor_region, witness_region
from eigenshape.stability.bounds import TimeRange, WeylBound, trusted_times, weyl_bound
from eigenshape.stability.cheeger import CheegerEstimate, cheeger_estimate
from eigenshape.stability.closeness import Closeness, map_closeness, measure_closeness
from eigenshape.stability.correspondence import (
    BottleneckMatching,
    MaximumMatching,
    bottleneck_matching,
    correspondence_graph,
    matching_reach,
    maximum_matching,
)
from eigenshape.stability.perturbation import Perturbation, perturbation, vertex_pairs
from eigenshape.stability.rates import THEOREMS, Rate, cover_by_rate, fit_rate, theorem_rate
from eigenshape.stability.report import StabilityPlan, StabilityReport, compare_shapes
from eigenshape.stability.sampled import ChangeAtTime

__version__ = importlib.metadata.version("eigenshape")

__all__ = [
    "CREATURES",
    "OPERATORS",
    "PART_CONTRAST",
    "SCALE_FREE",
    "THEOREMS",
    "THESIS",
    "USUAL",
    "AnchorNodes",
    "ApproximateSignature",
    "Ball",
    "BatchReport",
    "Binding",
    "BottleneckMatching",
    "Box",
    "Brackets",
    "Brush",
    "Camera",
    "Certificate",
    "ChangeAtTime",
    "CheegerEstimate",
    "Closeness",
    "ConvergenceError",
    "DeformationSession",
    "DepthCamera",
    "DepthScan",
    "DescribedLargeShape",
    "DescribedShape",
    "DetailedSkeleton",
    "Distortion",
    "EdgeTable",
    "Edit",
    "EigenRig",
    "EigenshapeError",
    "EigenspaceAngles",
    "FacetTable",
    "FeaturePoints",
    "FileFormatError",
    "FoundParts",
    "FunctionalMap",
    "GaussianKernel",
    "InvalidParameterError",
    "InvalidShapeError",
    "Item",
    "LabelTransfer",
    "Laplacian",
    "Law",
    "Match",
    "MaximumMatching",
    "MergeTree",
    "MeshLike",
    "MeshPart",
    "MissingExtraError",
    "Move",
    "NotJudged",
    "Operator",
    "OperatorReport",
    "Panel",
    "PartTree",
    "PatchCodebook",
    "PatchDescriptor",
    "PatchMatch",
    "PatchPoints",
    "PatchRecipe",
    "Patches",
    "PersistenceDiagram",
    "PersistencePairs",
    "Perturbation",
    "PointCloud",
    "Quadrature",
    "Rate",
    "Recipe",
    "Record",
    "Repaired",
    "RepairedCloud",
    "Rotation",
    "Segmentation",
    "ShapeDescriptor",
    "ShapeIndex",
    "ShapeLike",
    "SimplicialMesh",
    "SkeletonGrip",
    "Spectrum",
    "SpectrumComparison",
    "StabilityPlan",
    "StabilityReport",
    "StoreError",
    "SurfacePoints",
    "TimeRange",
    "Translation",
    "TriangleMesh",
    "WeylBound",
    "Workers",
    "affinity_distance",
    "affinity_eigenvalues",
    "anchor_nodes",
    "anchor_region",
    "anisotropic_laplacian",
    "apply_edit",
    "approximate_heat_kernel_signature",
    "approximate_spectrum",
    "as_mesh",
    "as_rigid_as_possible",
    "as_shape",
    "average_geodesic_distance",
    "ball",
    "ball_eigenvalues",
    "bend",
    "biharmonic_blend",
    "bind",
    "bottleneck_distance",
    "bottleneck_matching",
    "boundary_edges",
    "boundary_loops",
    "boundary_surface",
    "boundary_vertices",
    "box",
    "box_eigenvalues",
    "bracket_eigenvalues",
    "build_index",
    "build_laplacian",
    "certify",
    "check_laplacian",
    "check_operator",
    "cheeger_estimate",
    "circle",
    "cloud_quadrature",
    "collapse_needles",
    "compare_shapes",
    "compare_spectra",
    "compose_maps",
    "connection_laplacian",
    "correspondence_graph",
    "cotangent_laplacian",
    "cover_by_rate",
    "crouzeix_raviart_laplacian",
    "curvature_tensors",
    "cut_by_planes",
    "default_energies",
    "default_times",
    "deform",
    "denoise",
    "describe",
    "describe_large_mesh",
    "describe_mesh",
    "describe_patch_views",
    "describe_patches",
    "describe_shape",
    "describe_to_keep",
    "describe_views",
    "detail_skeleton",
    "dirichlet_laplacian",
    "disc",
    "disc_eigenvalues",
    "disjoint_union",
    "drop_copies",
    "drop_degenerate",
    "drop_duplicate_faces",
    "drop_unreferenced",
    "dual_volumes",
    "edge_graph",
    "edge_lengths",
    "edge_table",
    "eigen_deformed",
    "eigen_skeleton",
    "eigenspace_angles",
    "eigenspace_errors",
    "enclosed_volume",
    "enclosing_ball",
    "encode_patches",
    "euler_characteristic",
    "face_areas",
    "face_normals",
    "facet_table",
    "farthest_points",
    "fem_boundary_nodes",
    "fem_laplacian",
    "fem_nodes",
    "fibonacci_sphere",
    "figure_contact_sheet",
    "figure_diagram",
    "figure_eigenfunctions",
    "figure_field",
    "figure_label_transfer",
    "figure_merge_tree",
    "figure_poses",
    "figure_segments",
    "figure_spectra",
    "figure_spectrum",
    "figure_stability",
    "find_parts",
    "fit_rate",
    "flat_torus_eigenvalues",
    "from_arrays",
    "from_pyvista",
    "from_trimesh",
    "functional_laplacian",
    "functional_map",
    "gaussian_curvature",
    "gaussian_laplacian",
    "geodesic_balls",
    "geodesic_distance_to_set",
    "geodesic_distances",
    "graded_sphere",
    "graph_laplacian",
    "grid",
    "grip_skeleton",
    "heat_kernel_signature",
    "icosphere",
    "in_words",
    "interval",
    "irregular_grid",
    "is_closed",
    "is_manifold",
    "largest_component",
    "learn_words",
    "light_field",
    "light_field_distance",
    "made_codebook",
    "make_creature",
    "map_closeness",
    "map_from_points",
    "match_features",
    "match_patches",
    "matching_reach",
    "matching_score",
    "maximum_matching",
    "mean_curvature",
    "mean_side_length",
    "measure_closeness",
    "measure_distortion",
    "merge_targets",
    "merge_tree",
    "mesh_laplacian",
    "mesh_quadrature",
    "moved_skeleton",
    "neighbor_graph",
    "noise_level",
    "normalize_area",
    "normalize_box",
    "normalize_diameter",
    "orient",
    "orient_outward",
    "part_colors",
    "part_spectrum",
    "part_tree",
    "partial_scan",
    "patch_distances",
    "patch_points",
    "patch_scores",
    "persistence_diagram",
    "perturbation",
    "point_cloud_laplacian",
    "point_map",
    "projective_plane",
    "projective_plane_eigenvalues",
    "quadrature_laplacian",
    "random_planes",
    "random_sphere",
    "read_codebook",
    "read_edits",
    "read_mesh",
    "read_points",
    "read_shape",
    "refine_map",
    "reflection_free_signature",
    "region_boundary",
    "region_mask",
    "repair",
    "replay",
    "rig_shape",
    "robust_laplacian",
    "rotation_by_drag",
    "sample_surface",
    "save_figure",
    "scale_invariant_heat_kernel_signature",
    "seal_holes",
    "seen_patches",
    "segment",
    "self_intersections",
    "separated_groups",
    "shape_dna",
    "shape_dna_distance",
    "simplex_volumes",
    "simulate_scan",
    "smooth_boundaries",
    "solve_dirichlet",
    "solve_spectrum",
    "spectral_hausdorff_distance",
    "spectral_rigid",
    "sphere_eigenvalues",
    "sphere_functional_eigenvalues",
    "sphere_harmonics",
    "sphere_hull",
    "sphere_quadrature",
    "subdivide",
    "suggest_repairs",
    "surface_area",
    "tangent_frames",
    "theorem_rate",
    "three_quarter_view",
    "three_sphere",
    "to_arrays",
    "to_pyvista",
    "to_trimesh",
    "torus",
    "torus_quadrature",
    "touching_parts",
    "train_codebook",
    "transfer_deformation",
    "transfer_function",
    "transfer_labels",
    "trusted_times",
    "uniform_quadrature",
    "value_colors",
    "vertex_components",
    "vertex_normals",
    "vertex_pairs",
    "view_distances",
    "wave_kernel_signature",
    "weld",
    "weld_seams",
    "weyl_bound",
    "witness_region",
    "word_distances",
    "write_codebook",
    "write_edits",
    "write_mesh",
    "write_points",
]
