"""Nobody can change a value: neither the one that was made, nor any copy or pickle of it."""

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from public_names import public_things
from test_thread_laws import digest
from thread_calls import CALLS, Shared

import eigenshape as es


def read_attributes(mesh: es.TriangleMesh) -> es.io.MeshAttributes:
    with TemporaryDirectory() as folder:
        path = Path(folder, "ball.vtu")
        es.io.write_fields(mesh, path, {"height": mesh.vertices[:, 2]})
        return es.read_mesh(path, attributes=True)[1]


CLASSES = {
    name: thing
    for name, thing in public_things().items()
    if inspect.isclass(thing) and not issubclass(thing, Exception)
}
# Calls whose answers hold the values that `Shared` has none of.
CALLED = [
    "align_modes",
    "brain_print",
    "compare_modes",
    "condense",
    "nodal_parcels",
    "DepthCamera",
    "ShapeIndex",
    "approximate_heat_signature",
    "bottleneck_matching",
    "bracket_eigenvalues",
    "carry_landmarks",
    "build_laplacian",
    "check_laplacian",
    "cheeger_estimate",
    "compare_groups",
    "shape_quadrature",
    "cut_by_planes",
    "decompose_field",
    "detect_watermark",
    "draw",
    "edge_table",
    "enclosing_ball",
    "facet_table",
    "find_heat_features",
    "find_items",
    "fit_allometry",
    "fit_procrustes",
    "fit_surface",
    "geodesic_path",
    "heat_trace",
    "match_patches",
    "maximum_matching",
    "measure_distortion",
    "nodal_domains",
    "part_tree",
    "principal_components",
    "principal_curvatures",
    "repair",
    "symmetric_components",
    "theorem_rate",
    "weyl_bound",
]
MADE: dict[str, Callable[[Shared], Any]] = {
    "DecimatedMesh": lambda v: es.geometry.decimate(v.ball, ratio=0.5),
    "Material": lambda v: es.io.Material("oak", image=b"grain", image_name="grain.png"),
    "MeshAttributes": lambda v: read_attributes(v.ball),
    "BatchReport": lambda v: es.retrieval.BatchReport(("a",), (), (("b", "no mesh"),), ()),
    "BoxRegion": lambda v: es.deformation.BoxRegion([-1, -1, -1], [1, 1, 1]),
    "BrushRegion": lambda v: es.deformation.BrushRegion([0, 0, 1], 0.5),
    "Damage": lambda v: es.retrieval.Damage("rows", "cut"),
    "DeformationSession": lambda v: es.deformation.replay(v.rig, [v.edit]),
    "DepthCamera": lambda v: es.scans.DepthCamera(resolution=40),
    "DescribedShape": lambda v: es.retrieval.DescribedShape("a", [v.by_heat[0]]),
    "FusedScan": lambda v: es.matching.fuse_scans([v.fish_scan]),
    "IndexReport": lambda v: v.index.verify(),
    "Operator": lambda v: es.operators.OPERATORS["cotangent"],
    "Outfit": lambda v: es.matching.transfer(v.worn, es.icosphere(2)),
    "Panel": lambda v: es.plot.Panel(v.ball, "a", np.zeros(v.ball.n_faces, int), np.arange(3)),
    "Parcellation": lambda v: v.halves,
    "PartDecomposition": lambda v: es.find_parts(v.animal),
    "Scaling": lambda v: es.deformation.Scaling([0.5, 0, 0], [2, 1, 0.5]),
    "SpectralClusterer": lambda v: es.spectral.SpectralClusterer(3),
    "SpectralEmbedder": lambda v: es.spectral.SpectralEmbedder(3),
    "StabilityPlan": lambda v: es.stability.StabilityPlan(k=5),
    "VectorHeat": lambda v: es.calculus.prepare_vector_heat(es.PointCloud(v.ball.vertices, dim=2)),
    "Workers": lambda v: es.retrieval.Workers(2),
}
# What may change inside values.
CHANGING = {
    "IndexState": "what an index holds at present",
    "RowTree": "moves while a map is refined; that of a value stays where it is",
    "SymmetricFactor": "compiled loops are made for arrays that can be written to",
}
HANDLES = {
    "FaissEngine": "holds memory of FAISS",
    "QdrantEngine": "holds a connection to a database",
    "Solver": "its matrices may be changed, as those of LaPy's solver",
}


def parts(value: Any) -> Iterator[Any]:
    """Yield a value, and all that stands in its public fields, in theirs, and so on."""
    yield value
    inner: list[Any] = []
    if isinstance(value, list | tuple):
        inner += value
    elif isinstance(value, dict):
        inner += value.values()
    if dataclasses.is_dataclass(value):
        inner += [
            getattr(value, field.name)
            for field in dataclasses.fields(value)
            if type(value).__name__ in CLASSES
        ]
    for each in inner:
        yield from parts(each)


def writable(value: Any) -> list[str]:
    """Return the places of all arrays in a value that can be written to, in private parts as well."""
    found, seen, waiting = [], {}, [(type(value).__name__, value)]
    while waiting:
        place, part = waiting.pop()
        if id(part) in seen or type(part).__name__ in CHANGING:
            continue
        seen[id(part)] = part  # kept, so that no other object takes its number
        inner: dict[Any, Any] = {}
        if isinstance(part, np.ndarray):
            found += [place] * (part.flags.writeable and part.size > 0)
        elif sp.issparse(part):
            inner = vars(part)
        elif isinstance(part, dict):
            inner = part
        elif isinstance(part, list | tuple):
            inner = dict(enumerate(part))
        elif type(part).__module__.startswith("eigenshape."):
            inner = getattr(part, "__dict__", {})
        waiting += [(f"{place}.{name}", each) for name, each in inner.items()]
    return sorted(found)


@pytest.fixture(scope="module")
def values(shared: Shared) -> dict[str, Any]:
    """Return one value of each public class, by its name."""
    shared.reader.query(shared.by_patches[0])  # a reader keeps what it has read
    made = {name: make(shared) for name, make in MADE.items()}
    found: dict[str, Any] = {}
    for source in [*vars(shared).values(), *(CALLS[name](shared) for name in CALLED)]:
        for part in parts(source):
            found.setdefault(type(part).__name__, part)
    return {name: value for name, value in (found | made).items() if name in CLASSES}


def test_there_is_a_value_of_every_public_class(values: dict[str, Any]) -> None:
    assert CLASSES.keys() - values.keys() <= HANDLES.keys()


def restore(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("name", sorted(CLASSES.keys() - HANDLES.keys()))
def test_a_copy_of_a_value_is_equal_works_and_cannot_be_changed(
    name: str, values: dict[str, Any]
) -> None:
    value = values[name]
    copies = [restore(value), copy.deepcopy(value), copy.copy(value)]
    if dataclasses.is_dataclass(value):
        if all(field.init for field in dataclasses.fields(value)):
            copies.append(dataclasses.replace(value))
        # The digest takes all numbers, and what properties and `explain` say.
        if name != "Operator":  # holds a function
            assert {digest(each) for each in copies} == {digest(value)}
    # The digest has filled what properties keep.
    for each in [value, *copies]:
        assert type(each) is type(value)
        assert not writable(each)


def test_the_law_finds_arrays_that_can_be_written_to_at_any_depth() -> None:
    ball = es.icosphere(1)
    spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 4)
    assert writable([{"inner": (spectrum, np.zeros(2))}]) == ["list.0.inner.1"]
    spectrum.mass.data.flags.writeable = True
    assert writable(spectrum) == ["Spectrum.mass.data"]


def test_a_value_takes_a_copy_of_an_array_that_can_be_written_to(values: dict[str, Any]) -> None:
    spectrum, mine = values["Spectrum"], values["Spectrum"].eigenvalues.copy()
    changed = dataclasses.replace(spectrum, eigenvalues=mine)
    mine[:] = 0
    np.testing.assert_array_equal(changed.eigenvalues, spectrum.eigenvalues)
    with pytest.raises(ValueError, match="read-only"):
        changed.eigenvalues[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        restore(spectrum).mass.data[0] = 1.0


def test_copies_of_a_reader_and_of_a_session_go_their_own_ways(values: dict[str, Any]) -> None:
    session = values["DeformationSession"]
    other = copy.copy(session)
    other.undo()
    assert (len(session.edits), len(other.edits)) == (1, 0)
    np.testing.assert_array_equal(restore(session).mesh.vertices, session.mesh.vertices)
    reader, descriptor = values["IndexReader"], values["HeatDescriptor"]
    with restore(reader) as another:
        found = another.query(descriptor, n_matches=2)
    assert [each.name for each in found] == [
        each.name for each in reader.query(descriptor, n_matches=2)
    ]
