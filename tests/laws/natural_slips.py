"""Hand every public function what people hand over by mistake, as they see it: without the type checks of the tests.

Run as a script with names of functions, or without for all, it prints what went wrong as JSON. A new public function
that takes one of our values needs nothing here as long as its other arguments have a type or a name that is known
below.
"""

import inspect
import json
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, is_dataclass
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
import scipy.sparse as sp
from describers import keep
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from public_names import public_things

import eigenshape as es
from eigenshape.plot import render
from eigenshape.retrieval.search.options import QueryOptions

FOLDER = Path(tempfile.mkdtemp())


@dataclass
class Form:
    """The unit of length, a surface that stands for the body in that unit, and how many modes it has."""

    unit: float = 1.0
    surface: es.TriangleMesh | None = None
    n_modes: int = 40


FORM = Form()


@contextmanager
def given_as(
    surface: es.TriangleMesh | None = None, *, unit: float = 1.0, n_modes: int = 40
) -> Iterator[None]:
    """Let all values be those of another body, or of the same in another unit."""
    start_afresh(Form(unit, surface, n_modes))
    try:
        yield
    finally:
        start_afresh(Form())


def start_afresh(form: Form) -> None:
    """Clear what is kept of the form before, and leave its files behind."""
    global FORM, FOLDER  # the values read them
    FORM, FOLDER = form, Path(tempfile.mkdtemp())
    for value in globals().values():
        if hasattr(value, "cache_clear"):
            value.cache_clear()


@cache
def body() -> es.TriangleMesh:
    """A closed surface without symmetry."""
    surface = FORM.surface
    if surface is None:
        ball = es.icosphere(2)
        x, y, z = ball.vertices.T
        radius = 1 + 0.3 * x * y + 0.2 * z**3 + 0.1 * np.sin(3 * x + y)
        surface = es.TriangleMesh(ball.vertices * [1.0, 1.3, 0.8] * radius[:, None], ball.faces)
    return es.TriangleMesh(FORM.unit * surface.vertices, surface.faces)


@cache
def bent() -> es.TriangleMesh:
    mesh = body()
    waves = np.sin(mesh.vertices[:, ::-1] / FORM.unit)
    return es.TriangleMesh(mesh.vertices + 0.01 * FORM.unit * waves, mesh.faces)


@cache
def spectrum() -> es.Spectrum:
    return es.solve_spectrum(
        es.cotangent_laplacian(body()), min(FORM.n_modes, body().n_vertices - 1)
    )


@cache
def rig() -> es.deformation.EigenRig:
    return es.rig_shape(body())


@cache
def target() -> es.matching.MatchTarget:
    return es.matching.prepare_target(body())


@cache
def matched() -> es.matching.ShapeMatch:
    return es.match_shapes(body(), target())


@cache
def collection() -> es.collections.Collection:
    return es.collections.build_collection({"one": body(), "two": body()}, FOLDER / "bones")


def head() -> es.deformation.BoxRegion:
    u = FORM.unit
    return es.deformation.BoxRegion([-99 * u, 0.8 * u, -99 * u], [99 * u, 99 * u, 99 * u])


def turn() -> es.Rotation:
    return es.Rotation([0, 0.5 * FORM.unit, 0], [1, 0, 0], 0.2)


@cache
def binding() -> es.deformation.Binding:
    return es.deformation.bind(rig(), [head()])


@cache
def described() -> es.retrieval.HeatFeatures:
    return es.retrieval.find_heat_features(body())


@cache
def recipe() -> es.retrieval.PatchRecipe:
    return es.retrieval.PatchRecipe()


@cache
def patches() -> es.retrieval.Patches:
    return es.retrieval.extract_patches(body(), n_views=0)[0]


@cache
def patched() -> es.retrieval.PatchDescriptor:
    return es.retrieval.patch_descriptor([patches()], recipe())


@cache
def shelf() -> es.ShapeIndex:
    index = es.ShapeIndex.create(FOLDER / "index")
    keep(index, "body", [described().descriptor])
    return index


@cache
def labels() -> np.ndarray:
    return described().parts.labels


@cache
def parcels() -> es.features.Parcellation:
    return es.features.Parcellation((height() > 0).astype(int), ("low", "high"))


@cache
def mapping() -> es.spectral.FunctionalMap:
    return es.spectral.map_from_points(
        spectrum(), spectrum(), np.arange(body().n_vertices), n_modes=10
    )


@cache
def latent() -> es.spectral.LatentBasis:
    return es.spectral.latent_basis({(0, 1): mapping()})


def plan() -> es.stability.StabilityPlan:
    return es.stability.StabilityPlan(k=5, n_samples=100, times=(0.1 * FORM.unit**2,))


@cache
def report() -> es.stability.StabilityReport:
    return es.compare_shapes(body(), bent(), plan())


def written_edits() -> Path:
    es.io.write_edits(
        [es.deformation.Edit((es.deformation.Move(head(), turn()),))], body(), FOLDER / "edits.json"
    )
    return FOLDER / "edits.json"


def folder_of_meshes() -> Path:
    """A folder with a file that is no mesh: it is refused in a moment."""
    folder = FOLDER / "meshes"
    folder.mkdir(exist_ok=True)
    (folder / "empty.ply").touch()
    return folder


def with_boundary() -> es.TriangleMesh:
    return es.TriangleMesh(body().vertices, body().faces[1:])


def face_vectors() -> np.ndarray:
    """A tangent vector of each face: the side between the first two of its vertices."""
    starts, ends, _ = body().vertices[np.sort(body().faces)].transpose(1, 0, 2)
    return ends - starts


def height() -> np.ndarray:
    return body().vertices[:, 1].copy()


def written_scene() -> Path:
    """Return a file that may hold several scenes."""
    es.write_mesh(body(), FOLDER / "scene.glb")
    return FOLDER / "scene.glb"


# A right value of each type; of a mesh and its kin, `body` itself.
def written_attributes() -> es.io.MeshAttributes:
    """Return what a file of a mesh holds besides."""
    es.write_mesh(body(), FOLDER / "held.ply")
    attributes: es.io.MeshAttributes = es.read_mesh(FOLDER / "held.ply", attributes=True)[1]
    return attributes


def worn_attributes() -> es.io.MeshAttributes:
    """Return what a file of a mesh with a field holds besides."""
    es.io.write_fields(body(), FOLDER / "worn.vtp", {"height": height()})
    attributes: es.io.MeshAttributes = es.read_mesh(FOLDER / "worn.vtp", attributes=True)[1]
    return attributes


def skulls() -> np.ndarray:
    """Landmarks of four specimens."""
    return np.random.default_rng(0).standard_normal((4, 6, 3)) * FORM.unit


def written_parcels() -> Path:
    es.io.write_parcellation(body(), FOLDER / "parcels.annot", parcels())
    return FOLDER / "parcels.annot"


def written_volume() -> Path:
    es.io.write_fields(body(), FOLDER / "volume.mgh", {"height": height()})
    return FOLDER / "volume.mgh"


VALUES: dict[Any, Callable[[], Any]] = {
    es.features.Parcellation: parcels,
    es.compat.lapy.Solver: lambda: es.compat.lapy.Solver(
        SimpleNamespace(v=body().vertices, t=body().faces)
    ),
    es.modes.BrainPrint: lambda: es.modes.brain_print({"lh": body(), "rh": bent()}, 9),
    es.modes.ParcelTree: lambda: es.modes.nodal_parcels(es.cotangent_laplacian(body()), 5),
    es.TriangleMesh: body,
    es.PointCloud: lambda: es.PointCloud(body().vertices),
    es.Laplacian: lambda: es.cotangent_laplacian(body()),
    es.Spectrum: spectrum,
    es.features.MergeTree: lambda: es.merge_tree(body(), height()),
    es.features.Segmentation: lambda: described().parts,
    es.features.FeaturePoints: lambda: described().parts.features,
    es.retrieval.HeatDescriptor: lambda: described().descriptor,
    es.retrieval.HeatRecipe: lambda: es.retrieval.SCALE_FREE,
    es.retrieval.PatchRecipe: recipe,
    es.retrieval.PatchCodebook: es.retrieval.default_codebook,
    es.retrieval.PatchDescriptor: patched,
    es.retrieval.Patches: patches,
    es.retrieval.PatchPoints: lambda: patched().points[0],
    es.features.PersistenceDiagram: lambda: es.features.persistence_diagram(body(), height()),
    es.deformation.EigenRig: rig,
    es.deformation.Binding: binding,
    es.Rotation: turn,
    es.deformation.Move: lambda: es.deformation.Move(head(), turn()),
    es.deformation.Edit: lambda: es.deformation.Edit((es.deformation.Move(head(), turn()),)),
    es.deformation.BoxRegion: head,
    es.deformation.SkeletonResponse: lambda: es.deformation.skeleton_response(binding()),
    es.deformation.DetailedSkeleton: lambda: es.deformation.detailed_skeleton(binding()),
    es.morphometrics.Landmarks: lambda: es.morphometrics.Landmarks(
        ["nose"], [[0.0, FORM.unit, 0.0]]
    ),
    es.spectral.FunctionalMap: mapping,
    es.spectral.LatentBasis: latent,
    es.matching.MatchTarget: target,
    es.matching.ShapeMatch: matched,
    es.matching.Registration: lambda: es.matching.register_scans(body(), body()),
    es.collections.Collection: collection,
    es.collections.CarriedLandmarks: lambda: es.collections.carry_landmarks(
        collection(), {"one": es.morphometrics.Landmarks(["tip"], body().vertices[:1])}
    ),
    es.collections.Similarity: lambda: es.collections.Similarity(
        2.0, np.eye(3), np.full(3, FORM.unit)
    ),
    es.matching.FusedScan: lambda: es.matching.fuse_scans([body()]),
    "fuse_scans.scans": lambda: [body()],
    es.stability.Perturbation: lambda: es.stability.measure_perturbation(body(), bent()),
    es.geometry.SurfacePoints: lambda: es.geometry.sample_surface(
        body(), 60, rng=np.random.default_rng(0)
    ),
    es.geometry.Quadrature: lambda: es.geometry.shape_quadrature(body()),
    es.spectral.Brackets: lambda: es.bracket_eigenvalues(body(), 10),
    es.stability.Rate: lambda: es.stability.Rate(1.0, -1.0),
    es.plot.Camera: lambda: es.plot.aim_camera(body()),
    es.scans.DepthCamera: es.scans.DepthCamera,
    es.plot.Panel: lambda: es.plot.Panel(body(), "body", labels(), np.arange(3)),
    es.retrieval.LabeledShape: lambda: es.retrieval.LabeledShape(body(), labels()),
    es.matching.Outfit: lambda: es.matching.transfer(worn_attributes(), body()),
    es.features.PartDecomposition: lambda: es.find_parts(body()),
    es.retrieval.LabelTransfer: lambda: es.transfer_labels(
        es.retrieval.LabeledShape(body(), labels()), body()
    ),
    es.stability.StabilityPlan: es.stability.StabilityPlan,
    es.stability.StabilityReport: report,
    es.spectral.SpectrumComparison: lambda: es.spectral.compare_spectra(spectrum(), spectrum()),
    es.ShapeIndex: shelf,
    es.retrieval.IndexReader: lambda: shelf().reader(),
    QueryOptions: QueryOptions,
    es.calculus.LinearSolver: lambda: es.calculus.factor_equations(
        es.cotangent_laplacian(body()).stiffness
    ),
    es.calculus.HeatGeodesics: lambda: es.calculus.prepare_heat_geodesics(body()),
    es.calculus.VectorHeat: lambda: es.calculus.prepare_vector_heat(body()),
    es.spectral.OperatorBundle: lambda: es.spectral.operator_bundle(body(), 10),
    es.DeformationSession: lambda: es.DeformationSession(rig()),
    es.retrieval.Workers: es.retrieval.Workers,
    es.retrieval.Item: lambda: es.retrieval.Item("body", FOLDER / "body.ply"),
    Figure: Figure,
    np.random.Generator: lambda: np.random.default_rng(0),
}
# A right value of each argument whose type is not ours, by its name; "function.name" where a name has several meanings.
NAMED: dict[str, Callable[[], Any]] = {
    "specimens": skulls,
    "shapes": skulls,
    "train_codebook.shapes": lambda: [VALUES[es.retrieval.Patches]()],
    "compare_groups.groups": lambda: [0, 0, 1, 1],
    "fit_allometry.sizes": lambda: [FORM.unit, 2 * FORM.unit, 3 * FORM.unit, 5 * FORM.unit],
    "symmetric_components.pairs": lambda: [[0, 1]],
    "warp_mesh.starts": lambda: body().vertices[:9],
    "warp_mesh.ends": lambda: bent().vertices[:9],
    "alpha": lambda: 1.0,
    "build_collection.specimens": lambda: {"one": body(), "two": body()},
    "build_collection.folder": lambda: FOLDER / "bones",
    "carry_landmarks.labelled": lambda: {
        "one": es.morphometrics.Landmarks(["tip"], body().vertices[:1])
    },
    "carry_attributes.attributes": written_attributes,
    "resample_curves.n_points": lambda: 5,
    "decimate.n_faces": lambda: 100,
    "write_fields.fields": lambda: {"height": height()},
    "write_fields.path": lambda: FOLDER / "written.vtu",
    "set_threads.n": lambda: None,
    "match_shapes.scale": lambda: "known",
    "match_shapes.overlap": lambda: "full",
    "average_onto_points.values": face_vectors,
    "bind.regions": lambda: [head()],
    "boundary_load.mesh": with_boundary,
    "boundary_surface.mesh": lambda: es.shapes.box(2, 2, 2),
    "build": lambda: es.cotangent_laplacian,
    "conductivity": lambda: np.ones(body().n_vertices),
    "cache": lambda: FOLDER / "cache",
    "caption": lambda: "",
    "certify.eigenvalues": lambda: spectrum().eigenvalues,
    "certify.eigenvectors": lambda: spectrum().eigenvectors,
    "check_laplacian.shape": body,
    "closest_points.points": lambda: bent().vertices,
    "coefficients": lambda: spectrum().eigenvectors[:5, 0],
    "compare_shapes.plan": plan,
    "count": lambda: 4,
    "curves": lambda: [np.sort(body().faces[0])[:2]],
    "decompose_one_form.values": lambda: np.ones(len(es.calculus.one_form_edges(body()))),
    "delta": lambda: 0.3 * FORM.unit,
    "eigenspace_errors.eigenvalues": lambda: spectrum().eigenvalues[:8],
    "eigenspace_errors.functions": lambda: spectrum().eigenvectors[:, :6],
    "difference_regions.difference": lambda: np.eye(5),
    "difference_regions.shape": lambda: 0,
    "end": lambda: 5,
    "export_bundle.form": lambda: "numpy",
    "extend_scalar.values": lambda: [1.0, 2.0],
    "fixed": lambda: np.arange(4),
    "flatten_conformally.mesh": with_boundary,
    "figure_matches.matches": lambda: shelf().query(body()),
    "figure_matches.meshes": lambda: {match.name: body() for match in shelf().query(body())},
    "PatchDescriptor.is_mirror_image.other": patched,  # its annotation is a name
    "flat_torus_eigenvalues.periods": lambda: np.eye(2),
    "flux": height,
    "geodesic_path.start": lambda: 0,
    "functional_map.pairs": lambda: np.column_stack([np.arange(160)] * 2),
    "heat_kernel.x": lambda: [0, 1],
    "heat_kernel.y": lambda: 2,
    "indices": lambda: [1, 2],
    "items": list,
    "k": lambda: 5,
    "key": lambda: "owner",
    "label": lambda: "height",
    "labels": labels,
    "labels_from_votes.labels": lambda: [4, 2, 7],
    "labels_from_votes.votes": lambda: np.eye(body().n_vertices)[:, :3],
    "LatentBasis.map_between.source": lambda: 0,
    "LatentBasis.map_between.target": lambda: 1,
    "latent_basis.maps": lambda: {(0, 1): mapping()},
    "level": lambda: 0.1 * FORM.unit,
    "logarithmic_map.source": lambda: 0,
    "make_creature.kind": lambda: "fish",
    "map_from_points.points": lambda: np.arange(body().n_vertices),
    "mask": lambda: es.deformation.region_mask(body(), head()),
    "move_skeleton.response": lambda: es.deformation.skeleton_response(binding()),
    "compare_modes.one": lambda: [height(), 2 * height()],
    "compare_modes.two": lambda: [FORM.unit - height(), height()],
    "drive": lambda: np.ones((5, 4)),
    "dt": lambda: 0.1,
    "geometric_connectome.n_modes": lambda: 10,
    "geometric_connectome.length_scale": lambda: 0.5 * FORM.unit,
    "wave_response.length_scale": lambda: 0.5 * FORM.unit,
    "rotation_nulls.n_nulls": lambda: 5,
    "weights": lambda: np.ones(body().n_vertices),
    "n": lambda: 50,
    "n_across": lambda: 8,
    "n_around": lambda: 9,
    "n_features": lambda: 3,
    "n_modes": lambda: 10,
    "n_parcels": lambda: 4,
    "name": lambda: "body",
    "names": lambda: ["weld"],
    "neighbor_graph.points": lambda: body().vertices,
    "nodes": lambda: body().vertices[:3],
    "normalize_mesh.measure": lambda: "box",
    "normalized_cut.labels": lambda: np.arange(body().n_vertices) % 3,
    "order": lambda: 2,
    "path": lambda: FOLDER / "written.ply",
    "planes": lambda: [[0.0, 1.0, 0.0, 0.5 * FORM.unit]],
    "point_map.mapping": mapping,
    "positions": lambda: bent().vertices,
    "poses": lambda: {"rest": body()},
    "radius": lambda: 0.4 * FORM.unit,
    "read": lambda: es.read_mesh,
    "query_indexes.folders": lambda: [shelf().folder],
    "mask_surface.mask": lambda: height() > 0,
    "read_edits.path": written_edits,
    "read_mesh.path": written_scene,
    "read_parcellation.path": written_parcels,
    "read_shape.path": written_scene,
    "read_surface.path": written_scene,
    "read_volume.path": written_volume,
    "transfer.source": worn_attributes,
    "structure_surfaces.labels": lambda: np.full((3, 3, 3), 11),
    "structure_surfaces.structures": lambda: {"caudate": 11},
    "to_space": lambda: np.diag([FORM.unit, FORM.unit, FORM.unit, 1.0]),
    "voxel_surface.inside": lambda: np.ones((3, 3, 3)),
    "recover_geometry.eigenvalues": lambda: es.shapes.sphere_eigenvalues(60) / FORM.unit**2,
    "region": head,
    "response": lambda: np.ones_like,
    "rho": lambda: 3.0,
    "save_figure.path": lambda: FOLDER / "written.png",
    "ShapeIndex.add.n_views": lambda: 0,
    "ShapeIndex.merge.others": lambda: [es.ShapeIndex.create(None)],
    "ShapeIndex.add.replace": lambda: True,
    "ShapeIndex.add_many.replace": lambda: True,
    "segment.n_regions": lambda: 3,
    "signed_distance.points": lambda: bent().vertices,
    "solve_harmonic.values": lambda: np.arange(4.0),
    "solve_heat.start": height,
    "solve_spectrum.k": lambda: 5,
    "sources": lambda: [0, 5],
    "sphere_harmonics.points": lambda: es.icosphere(1).vertices,
    "spectra": lambda: {"one": spectrum(), "two": spectrum()},
    "squared_wavenumber": lambda: FORM.unit**-2,
    "t": lambda: 0.05 * FORM.unit**2,
    "tensors": lambda: es.operators.curvature_tensors(body(), 1.0),
    "times": lambda: [0.1 * FORM.unit**2, 0.2 * FORM.unit**2],
    "trace_geodesic.start": lambda: 0,
    "transfer_function.values": height,
    "transport_vectors.vectors": lambda: np.eye(2),
    "up": lambda: "y",
    "values": height,
    "vector": lambda: [0.1 * FORM.unit, 0.0],
    "vectors": face_vectors,
    "vertices": lambda: np.arange(3),
    "view": lambda: [0.0, 0.0, 1.0],
    "winding_numbers.points": lambda: bent().vertices,
    "brain_print.surfaces": lambda: {"left": body()},
    "figure_cortex.surfaces": lambda: {"left": body()},
    "figure_cortex.values": lambda: {"left": height()},
    "figure_fields.fields": lambda: {"body": (body(), height())},
    "n_vertices": lambda: 9,
    "Parcellation.labels": lambda: [0, 1, -1],
    "Parcellation.names": lambda: ["low", "high"],
    "unmask.values": lambda: [1.0, 2.0, 3.0],
    "write_parcellation.path": lambda: FOLDER / "written.annot",
    "write_edits.path": lambda: FOLDER / "edits.json",
    "write_landmarks.path": lambda: FOLDER / "written.csv",
    "write_points.path": lambda: FOLDER / "written.xyz",
}
# What a mesh is in all but type: an answer must be that of the mesh.
SAME_MESH: dict[str, Callable[[], Any]] = {
    "trimesh": lambda: es.io.to_trimesh(body()),
    "pyvista": lambda: es.io.to_pyvista(body()),
    "pair": lambda: (body().vertices, body().faces),
    "SimplicialMesh": lambda: es.SimplicialMesh(body().points, body().simplices),
}
SLIPS: dict[str, Callable[[], Any]] = {
    **SAME_MESH,
    "mesh": body,
    "text": lambda: "cat.ply",
    "path": lambda: Path("cat.ply"),
    "cloud": lambda: es.PointCloud(body().vertices),
    "tetrahedra": lambda: es.shapes.box(2, 2, 2),
    "points": lambda: body().vertices,
    "repaired": lambda: es.repair(body(), ["weld"]),
    "laplacian": lambda: es.cotangent_laplacian(body()),
    "matrix": lambda: sp.eye_array(3, format="csr"),
    "spectrum": spectrum,
    "None": lambda: None,
    "number": lambda: 3,
}
DEAR = 0.5  # seconds, beyond which one of the forms of a mesh must do
OF_ITS_OWN_KIND = {
    ("subdivide", "SimplicialMesh")
}  # a SimplicialMesh is cut in another order than a TriangleMesh
MESHES = {es.TriangleMesh, es.SimplicialMesh, es.PointCloud}


def kinds(annotation: Any) -> Iterator[Any]:
    """Yield the types that a union is of, and what its lists and mappings are of."""
    if annotation is ArrayLike:
        yield complex  # the widest of the numbers that it is made of; NumPy 2.5 hides them in variables
    elif hasattr(annotation, "__value__"):  # an alias of typing_extensions, or of Python since 3.12
        yield from kinds(annotation.__value__)
    elif get_origin(annotation) in (Union, UnionType, Sequence, Iterable, Mapping, tuple):
        for part in get_args(annotation):
            yield from kinds(part)
    else:
        yield annotation


def public_callables() -> Iterator[tuple[str, Callable[..., Any], type | None]]:
    """Yield public functions, and public methods of public classes with their class."""
    for name, thing in public_things().items():
        if inspect.isfunction(thing):
            yield name, thing, None
        elif inspect.isclass(thing):
            for method, code in vars(thing).items():
                if inspect.isfunction(code) and not method.startswith("_"):
                    yield f"{name}.{method}", code, thing


def right_value(function: str, name: str, annotation: Any) -> Any:
    """Return a value that the argument may have.

    Raises
    ------
    LookupError
        If there is none here.
    """
    for key in (f"{function}.{name}", name):
        if key in NAMED:
            return NAMED[key]()
    wanted = [kind for kind in kinds(annotation) if kind in VALUES]
    if not wanted:
        raise LookupError(f"no right value of {name}: {annotation}")
    value = VALUES[wanted[0]]()
    return [value] if get_origin(annotation) in (Sequence, Iterable) else value


def fresh(value: Any) -> Any:
    """Return a value, and a generator of random numbers at its beginning."""
    return np.random.default_rng(0) if isinstance(value, np.random.Generator) else value


def same(one: Any, two: Any) -> bool:
    """Compare two answers part by part."""
    if isinstance(one, np.ndarray) or sp.issparse(one):
        both = [np.asarray(each.todense() if sp.issparse(each) else each) for each in (one, two)]
        return bool(np.array_equal(*both, equal_nan=both[0].dtype.kind == "f"))
    if isinstance(one, es.TriangleMesh | es.SimplicialMesh):
        return same(one.points, two.points) and same(one.simplices, two.simplices)
    if isinstance(one, float):
        return bool(np.array_equal(one, two, equal_nan=True))
    if isinstance(one, list | tuple):
        return len(one) == len(two) and all(map(same, one, two))
    if is_dataclass(one):
        return type(one) is type(two) and all(
            same(value, vars(two)[key]) for key, value in vars(one).items()
        )
    return type(one) is type(two)


def unnamed(value: Any, message: str) -> str | None:
    """Return a message that does not name what was given: its type, or that of the first where a list is meant."""
    first = value[:1] if isinstance(value, tuple) else ()
    names = ["None"] if value is None else [type(each).__name__ for each in (value, *first)]
    return (
        None if any(name in message for name in names) else f"does not name {names[0]}: {message}"
    )


def right_arguments(
    function: str, code: Callable[..., Any], owner: type | None
) -> tuple[dict[str, Any], set[str]]:
    """Return arguments that a function takes, and the names of those whose type is ours.

    Raises
    ------
    LookupError
        If there is no right value for one.
    """
    hints = get_type_hints(code)
    given: dict[str, Any] = {}
    ours = {name for name, hint in hints.items() if set(kinds(hint)) & (VALUES.keys() | MESHES)} - {
        "return"
    }
    for name, parameter in inspect.signature(code).parameters.items():
        needed = (
            parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        )
        if name == "self":
            given[name] = VALUES[owner]() if ours else None
        elif ours and (needed or f"{function}.{name}" in NAMED):
            given[name] = right_value(function, name, hints.get(name))
        elif name in ours:
            given[name] = parameter.default
    return given, ours & given.keys()


def is_accepted(slip: str, value: Any, allowed: set[Any]) -> bool:
    """Tell whether a signature promises to take a value; what it then makes of it is for other tests to say."""
    if es.SimplicialMesh in allowed and slip in (*SAME_MESH, "mesh", "tetrahedra"):
        return True
    if {complex, np.ndarray} & allowed and slip in ("points", "pair", "number", "matrix"):
        return True
    return any(isinstance(value, kind) for kind in allowed if isinstance(kind, type))


def complaints_about(
    function: str, code: Callable[..., Any], owner: type | None
) -> Iterator[tuple[str, str]]:
    """Yield what goes wrong where one argument of a function is a slip and the others are right."""
    starred = next(
        (
            name
            for name, each in inspect.signature(code).parameters.items()
            if each.kind is each.VAR_POSITIONAL
        ),
        None,
    )

    def call(**arguments: Any) -> Any:
        arguments = {name: fresh(value) for name, value in arguments.items()}
        first = [] if starred is None else [arguments.pop(starred)]
        return code(*first, **arguments)

    started = time.process_time()
    try:
        given, ours = right_arguments(function, code, owner)
        right = call(**given) if ours else None
    except Exception as error:  # noqa: BLE001 - the tables above are to be mended
        yield function, f"fails on right values: {type(error).__name__}: {error}"
        return
    dear = time.process_time() - started > DEAR
    for name in sorted(ours):
        allowed = set(kinds(get_type_hints(code)[name]))
        for slip, made in SLIPS.items():
            value = made()
            accepted = is_accepted(slip, value, allowed)
            is_the_mesh = es.SimplicialMesh in allowed and slip in SAME_MESH
            if (function, slip) in OF_ITS_OWN_KIND or (
                accepted and (slip == "mesh" or (dear and slip != "trimesh"))
            ):
                continue
            try:
                answer = call(**{**given, name: value})
            except es.EigenshapeError as error:
                found = None if accepted else unnamed(value, str(error))
            except Exception as error:  # noqa: BLE001 - the law is that there is none
                found = f"{type(error).__name__}: {error}"
            else:
                wrong = (
                    "another answer than for the mesh"
                    if is_the_mesh and not same(right, answer)
                    else None
                )
                found = wrong if accepted else "took it"
            if found:
                yield f"{function}({name}={slip})", found


def stand_in_for_the_studio() -> None:
    """Let `view` return the mesh that it hands to the studio, which is a package of its own."""
    widget: Any = ModuleType("eigenshape_studio.widget")
    widget.ShapeWidget = lambda mesh, _fields, *, height: mesh
    sys.modules |= {"eigenshape_studio": ModuleType("eigenshape_studio"), widget.__name__: widget}


def main() -> None:
    warnings.simplefilter("ignore")
    render.FINER = 1  # pictures without smooth edges, in a quarter of the time
    stand_in_for_the_studio()
    functions = list(public_callables())
    chosen = set(sys.argv[1:]) or {name for name, _, _ in functions}
    found = [
        complaint
        for name, code, owner in functions
        if name in chosen
        for complaint in complaints_about(name, code, owner)
    ]
    sys.stdout.write(json.dumps({"functions": len(functions), "complaints": found}))


if __name__ == "__main__":
    main()
