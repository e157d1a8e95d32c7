"""Type checks of arguments, with errors that say what to pass instead."""

import os
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from types import UnionType
from typing import Any, get_args

from eigenshape._errors import InvalidParameterError

# The call that makes a value of each type, from a mesh if possible.
MAKERS = {
    "Binding": "es.deformation.bind(rig, [region])",
    "Brackets": "es.bracket_eigenvalues(mesh, k)",
    "Camera": "es.plot.aim_camera(mesh)",
    "DepthCamera": "es.scans.DepthCamera()",
    "DescribedShape": "es.retrieval.DescribedShape(name, [es.describe(mesh)])",
    "DetailedSkeleton": "es.deformation.detailed_skeleton(binding)",
    "Edit": "es.deformation.Edit((es.deformation.Move(region, handle),))",
    "Collection": "es.collections.open_collection(folder)",
    "EigenRig": "es.rig_shape(mesh)",
    "FeaturePoints": "es.segment(tree).features",
    "Figure": "es.plot.figure_spectrum(spectrum)",
    "FunctionalMap": "es.functional_map(source, target, pairs)",
    "Generator": "numpy.random.default_rng(0)",
    "HeatDescriptor": "es.describe(mesh, es.retrieval.SCALE_FREE)",
    "HeatGeodesics": "es.calculus.prepare_heat_geodesics(mesh)",
    "HeatRecipe": "es.retrieval.SCALE_FREE",
    "Item": "es.retrieval.Item(name, path)",
    "LabelTransfer": "es.transfer_labels(labeled, target)",
    "LabeledShape": "es.retrieval.LabeledShape(mesh, labels)",
    "Landmarks": "es.morphometrics.Landmarks(names, points)",
    "Laplacian": "es.cotangent_laplacian(mesh)",
    "LatentBasis": "es.spectral.latent_basis(maps)",
    "LinearSolver": "es.calculus.factor_equations(matrix)",
    "Mapping": "{title: value}",
    "MergeTree": "es.merge_tree(mesh, values)",
    "Move": "es.deformation.Move(region, handle)",
    "Panel": "es.plot.Panel(mesh, title, labels, vertices)",
    "OperatorBundle": "es.spectral.operator_bundle(mesh, k)",
    "PartTree": "es.find_parts(mesh).tree",
    "PatchCodebook": "es.retrieval.default_codebook()",
    "PatchDescriptor": "es.describe(mesh)",
    "PatchPoints": "es.describe(mesh).points[0]",
    "PatchRecipe": "es.retrieval.PatchRecipe()",
    "Patches": "es.retrieval.extract_patches(mesh)[0]",
    "PersistenceDiagram": "es.features.persistence_diagram(shape, values)",
    "Perturbation": "es.stability.measure_perturbation(one, two)",
    "PointCloud": "es.PointCloud(points, dim=2)",
    "Quadrature": "es.geometry.shape_quadrature(mesh)",
    "Rate": "es.stability.theorem_rate(theorem, dim)",
    "Rotation": "es.Rotation(pivot, axis, angle)",
    "Segmentation": "es.segment(tree)",
    "ShapeIndex": "es.ShapeIndex.open(folder)",
    "SkeletonResponse": "es.deformation.skeleton_response(binding)",
    "ShapeTensors": "eigenshape.torch.shape_tensors(mesh, bundle)",
    "Spectrum": "es.solve_spectrum(laplacian, k)",
    "SpectrumComparison": "es.spectral.compare_spectra(one, two)",
    "StabilityPlan": "es.stability.StabilityPlan()",
    "StabilityReport": "es.compare_shapes(one, two)",
    "SurfacePoints": "es.geometry.sample_surface(mesh, n)",
    "TensorSpectrum": "eigenshape.torch.solve_spectrum(vertices, faces, k)",
    "Translation": "es.Translation(vector)",
    "TriangleMesh": "es.TriangleMesh(vertices, faces)",
    "VectorHeat": "es.calculus.prepare_vector_heat(mesh)",
    "Workers": "es.retrieval.Workers()",
}
# The call that reads a value of each type from a file.
READERS = {
    "Landmarks": "es.morphometrics.read_landmarks({path})",
    "PatchCodebook": "es.retrieval.read_codebook(Path({path}).read_bytes())",
    "PointCloud": "es.io.read_points({path}, dim=2)",
    "ShapeIndex": "es.ShapeIndex.open({path})",
    "Spectrum": "es.Spectrum.load({path})",
}
# The call that makes a value of one type from a value of another, if it is not the one in MAKERS.
CONVERSIONS = {
    ("PointCloud", "Laplacian"): "es.point_cloud_laplacian(cloud)",
    ("PointCloud", "Quadrature"): "es.geometry.shape_quadrature(cloud)",
    ("TriangleMesh", "PointCloud"): "es.PointCloud(mesh.points)",
    ("SimplicialMesh", "PointCloud"): "es.PointCloud(mesh.points, dim)",
    ("ndarray", "Laplacian"): "es.Laplacian(csr_array(stiffness), csr_array(mass))",
    ("sparse", "Laplacian"): "es.Laplacian(stiffness, mass)",
}


def require_type(value: object, kind: type | UnionType, name: str) -> None:
    """Raise an error if an argument is not an instance of `kind`.

    The message names the type of the value and says what to pass instead.
    """
    if not isinstance(value, kind):
        raise InvalidParameterError(
            f"{name} must be {describe_kind(kind)}; the value is {describe_value(value)}. "
            f"{suggest_argument(value, kind)}"
        )


def require_unicode(value: object, what: str) -> None:
    """Raise an error if a name or another text is none, or could not be stored."""
    if not isinstance(value, str) or value != value.encode(errors="replace").decode():
        raise InvalidParameterError(f"{what} must be Unicode text; {value!r} is not.")


def require_choice(value: object, choice: Any, name: str) -> None:
    """Raise an error if an option is none of the names that a Literal lists."""
    *names, last = get_args(choice)
    if value not in (*names, last):
        listed = "', '".join(names)
        raise InvalidParameterError(f"{name} must be '{listed}' or '{last}'; it is {value!r}.")


def require_each(values: object, kind: type | UnionType, name: str) -> None:
    """Raise an error if an argument is not a list of instances of `kind`."""
    if (
        isinstance(values, kind)
        or not isinstance(values, Iterable)
        or isinstance(values, str | bytes)
    ):
        remedy = f"Pass [{name}]." if isinstance(values, kind) else suggest_argument(values, kind)
        raise InvalidParameterError(
            f"{name} must be a list, each entry {describe_kind(kind)}; "
            f"it is {describe_value(values)}. {remedy}"
        )
    for index, value in enumerate(values):
        require_type(value, kind, f"{name}[{index}]")


def describe_kind(kind: type | UnionType) -> str:
    """Return the name of a type with its article; several types are joined by "or"."""
    names = [
        "None" if each is type(None) else f"{_article(each.__name__)} {each.__name__}"
        for each in _kinds(kind)
    ]
    return " or ".join(names)


def describe_value(value: object) -> str:
    """Return the type of a value with its article, and a text or number itself."""
    if value is None:
        return "None"
    name = type(value).__name__
    text = os.fspath(value) if isinstance(value, os.PathLike) else value
    shown = f" ({text!r})" if isinstance(text, str | int | float) else ""
    return f"{_article(name)} {name}{shown}"


def suggest_argument(value: object, kind: type | UnionType) -> str:
    """Say what to pass instead of a value.

    This is one of its attributes, the call that reads a file, or the call that makes such a value.
    """
    part = attribute_of(value, kind)
    if part:
        return f"Pass its attribute {part}."
    wanted = [each.__name__ for each in _kinds(kind) if each is not type(None)]
    if isinstance(value, str | os.PathLike):
        readers = [
            READERS[name].format(path=repr(os.fspath(value))) for name in wanted if name in READERS
        ]
        if readers:
            return f"Pass {readers[0]}."
    given = "sparse" if hasattr(value, "tocsr") else type(value).__name__
    calls = [CONVERSIONS.get((given, name)) or MAKERS.get(name) for name in wanted]
    return f"Pass {' or '.join(call for call in calls if call)}." if any(calls) else ""


def attribute_of(value: object, kind: type | UnionType) -> str | None:
    """Return the name of the first attribute that is an instance of `kind`, if there is one.

    For example, `mesh` is such an attribute of a RepairedMesh.
    """
    parts = fields(value) if is_dataclass(value) else ()
    return next(
        (part.name for part in parts if isinstance(getattr(value, part.name, None), kind)), None
    )


def _kinds(kind: type | UnionType) -> tuple[type, ...]:
    """Return the members of a union, or the type itself."""
    return get_args(kind) or (kind,)


def _article(name: str) -> str:
    return "an" if name.lower().startswith(("a", "e", "i", "o", "un", "nd")) else "a"
