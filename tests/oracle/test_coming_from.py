"""Each row of the tables for people who come from other libraries runs: their code, and ours beside it.

Code stands between backticks. Calls and assignments run in the order of the row. A name without a call is looked up on
their side, and called with right arguments on ours. Where both sides give numbers of the same shape, these are equal,
but for the rows that say how they differ.
"""

import ast
import contextlib
import io
import re
from collections.abc import Callable
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from laws.natural_slips import right_arguments

import eigenshape as es

DOCS = Path(__file__).resolve().parents[2] / "docs" / "coming_from"
DIFFERENCE = re.compile(r"\b(theirs|differ)\b")  # with which a row says that numbers are not equal


class Instance:
    """Their class, whose methods are those of a fresh instance, as a table writes them."""

    def __init__(self, kind: type, make: Callable[[], Any]) -> None:
        self.kind, self.make = kind, make

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.kind(*args, **kwargs)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.make(), name)


def bumpy_ball() -> es.TriangleMesh:
    ball = es.icosphere(2)
    x, y, z = ball.vertices.T
    radius = 1 + 0.3 * x * y + 0.2 * z**3 + 0.1 * np.sin(3 * x + y)
    return es.TriangleMesh(ball.vertices * [1.0, 1.3, 0.8] * radius[:, None], ball.faces)


def shared_names(folder: Path) -> dict[str, Any]:
    """What code on both sides may use: arrays and files."""
    mesh, sheet, solid = bumpy_ball(), es.shapes.grid(8, 6), es.shapes.box(3, 3, 3)
    es.write_mesh(mesh, folder / "shape.off")
    es.io.write_points(es.PointCloud(mesh.vertices), folder / "points.ply")
    es.write_mesh(mesh, folder / "lh.white")
    rim = es.geometry.boundary_loops(sheet)[0]
    loop = [*mesh.faces[10], mesh.faces[10][0]]
    angles = np.linspace(0, 2 * np.pi, len(rim), endpoint=False)
    return {
        "np": np,
        "sp": sp,
        "V": np.array(mesh.vertices),
        "F": np.array(mesh.faces),
        "P": np.array(mesh.vertices),
        "T": np.array(solid.simplices),
        "v": np.array(mesh.vertices),
        "t": np.array(mesh.faces),
        "v4": np.array(solid.points),
        "t4": np.array(solid.simplices),
        "h": np.array(mesh.vertices[:, 1]),
        "values": np.array(mesh.vertices[:, 1]),
        "heights": np.array([0.0, 1.0]),
        "sheet_V": np.array(sheet.vertices),
        "sheet_F": np.array(sheet.faces),
        "solid_V": np.array(solid.points),
        "rim": np.array(rim),
        "circle": np.column_stack([np.cos(angles), np.sin(angles)]),
        "points": 0.9 * mesh.vertices[:7],
        "path": str(folder / "shape.off"),
        "surfaces": {name: folder / f"{name}.vtk" for name in ("lh-white-2d", "rh-white-2d")},
        "fs_path": folder / "lh.white",
        "points_path": str(folder / "points.ply"),
        "field_path": str(folder / "height.vtu"),
        "new_path": str(folder / "new.obj"),
        "sheet_values": sheet.vertices[:, 0] ** 2,
        "segments": np.column_stack([np.arange(len(rim)), np.roll(np.arange(len(rim)), -1)]),
        "f": np.array(mesh.vertices[:, 1]),
        "on_faces": np.array(mesh.vertices[mesh.faces[:, 0], 1]),
        "vectors": np.array(es.calculus.gradient(mesh, mesh.vertices[:, 1])),
        "b": np.array([3, 90]),
        "bc": np.array([[0.0], [1.0]]),
        "sources": np.array([3, 90]),
        "p2p": np.arange(len(mesh.vertices)),
        "B": np.zeros((len(mesh.vertices), 1)),
        "Aeq": sp.csc_matrix(np.eye(1, len(mesh.vertices), 50)),
        "Beq": np.array([[0.3]]),
        "ends": np.array([0, 8]),
        "end_places": np.array([[0.0, 0.0], [1.0, 0.0]]),
        "t_coef": 1.0,
        "use_robust": False,
        "loop": loop,
        "points_on_mesh": [[(3, []), (90, [])]],
        "curves_on_mesh": [[(int(vertex), []) for vertex in loop]],
        "landmarks": np.array([[0, 0], [40, 40], [80, 80]]),
        "times": [0.1, 0.5],
        "i": 3,
        "j": 90,
        "data": np.sin(3 * mesh.vertices[:, 0]) + mesh.vertices[:, 1],
        "holes": np.where(mesh.vertices[:, 2] > 0.7, np.nan, mesh.vertices[:, 1]),
        "hetero": 1 + 0.3 * mesh.vertices[:, 1],
        "ext_input": np.outer(mesh.vertices[:, 1], np.linspace(0, 1, 30) ** 2),
        "keep": mesh.vertices[:, 2] < 0.6,
        "parcels": np.digitize(mesh.vertices[:, 0], [-0.3, 0.4]),
        "pair": np.array(mesh.vertices[:, :2]),
        "k": 12,
        "n": 20,
        "m": 1.0,
        "level": 0.1,
    }


def write_volume(folder: Path, label: int) -> Path:
    """Write a volume with a cube that has a label, and return its path."""
    nibabel = import_module("nibabel")
    voxels = np.zeros((9, 9, 9), np.uint8)
    voxels[3:6, 3:6, 3:6] = label
    nibabel.Nifti1Image(voxels, np.eye(4)).to_filename(folder / "labels.nii")
    return folder / "labels.nii"


def our_names(shared: dict[str, Any]) -> dict[str, Any]:
    mesh = bumpy_ball()
    laplacian = es.cotangent_laplacian(mesh)
    spectrum = es.solve_spectrum(laplacian, 40)
    return shared | {
        "es": es,
        "aseg_path": write_volume(Path(shared["path"]).parent, 11),  # the left caudate nucleus
        "mesh": mesh,
        "sheet": es.shapes.grid(8, 6),
        "solid": es.shapes.box(3, 3, 3),
        "cloud": es.PointCloud(mesh.vertices, dim=2),
        "laplacian": laplacian,
        "spectrum": spectrum,
        "source": spectrum,
        "target": spectrum,
        "mesh1": mesh,
        "mesh2": mesh,
        "pairs": shared["landmarks"],
    }


def names_of_lapy(shared: dict[str, Any]) -> dict[str, Any]:
    lapy = import_module("lapy")
    tet = lapy.TetMesh(shared["solid_V"], shared["T"])
    tet.orient_()

    def tria() -> Any:
        return lapy.TriaMesh(shared["V"].copy(), shared["F"].copy())

    names = {name: import_module(f"lapy.{name}") for name in ("diffgeo", "heat", "shapedna")}
    names |= {name: import_module(f"lapy.{name}") for name in ("conformal", "solver", "intersect")}
    names |= {name: import_module(f"lapy.{name}") for name in ("remesh", "plot", "io")}
    for module in list(names.values()):
        names |= {key: value for key, value in vars(module).items() if key not in names}
    tria().write_vtk(shared["path"].replace(".off", ".vtk"))
    evals, evecs = lapy.Solver(tria()).eigs(12)
    return names | {
        "lapy": lapy,
        "TriaMesh": Instance(lapy.TriaMesh, tria),
        "TetMesh": Instance(lapy.TetMesh, lambda: tet),
        "Solver": Instance(lapy.Solver, lambda: lapy.Solver(tria())),
        "Polygon": Instance(lapy.Polygon, lambda: lapy.Polygon(shared["circle"])),
        "tria": tria(),
        "tet": tet,
        "evals": evals,
        "evecs": evecs,
        "vtk_path": shared["path"].replace(".off", ".vtk"),
    }


def names_of_libigl(shared: dict[str, Any]) -> dict[str, Any]:
    igl, edges = import_module("igl"), es.geometry.edge_table((shared["V"], shared["F"]))
    return {"igl": igl, "scipy": import_module("scipy"), "edges": edges}


def names_of_potpourri3d(shared: dict[str, Any]) -> dict[str, Any]:
    return vars(import_module("potpourri3d")) | vars(import_module("robust_laplacian"))


def names_of_pyfm(shared: dict[str, Any]) -> dict[str, Any]:
    functional, meshes = import_module("pyFM.functional"), import_module("pyFM.mesh")
    mesh = meshes.TriMesh(shared["V"], shared["F"])
    mesh.process(40)
    return {
        "TriMesh": meshes.TriMesh,
        "FMN": import_module("pyFM.FMN").FMN,
        "FunctionalMapping": functional.FunctionalMapping,
        "signatures": import_module("pyFM.signatures"),
        "spectral": import_module("pyFM.spectral"),
        "mesh": mesh,
        "mesh1": mesh,
        "mesh2": mesh,
        "p2p": np.arange(len(shared["V"])),
    }


def names_of_neuromodes(shared: dict[str, Any]) -> dict[str, Any]:
    if np.lib.NumpyVersion(np.__version__) < "2.0.0":
        pytest.skip(
            "neuromodes.stats.parcellate calls numpy.asarray(copy=), which NumPy has since 2.0"
        )
    neuromodes, lapy = import_module("neuromodes"), import_module("lapy")
    tria = lapy.TriaMesh(shared["V"].copy(), shared["F"].copy())
    solver = neuromodes.EigenSolver(tria).solve(36)
    names: dict[str, Any] = {}
    for module in ("basis", "eigen", "io", "mesh", "network", "nulls", "stats", "waves"):
        names |= vars(import_module(f"neuromodes.{module}"))
    return names | {
        "EigenSolver": Instance(neuromodes.EigenSolver, lambda: solver),
        "tria": tria,
        "emodes": solver.emodes,
        "evals": solver.evals,
        "mass": solver.mass,
    }


def names_of_brainprint(shared: dict[str, Any]) -> dict[str, Any]:
    """What code beside brainprint may use: surfaces that its steps before made of a subject."""
    pytest.importorskip("brainprint")
    lapy = import_module("lapy")
    for path, factor in zip(shared["surfaces"].values(), (1.0, 1.1), strict=True):
        lapy.TriaMesh(shared["V"] * [1, 1, factor], shared["F"]).write_vtk(str(path))
    names: dict[str, Any] = {}
    for module in ("brainprint", "asymmetry", "surfaces", "utils.utils"):
        names |= vars(import_module(f"brainprint.{module}"))
    kind = names["Brainprint"]
    checks = {"environment_validation": False, "freesurfer_validation": False}
    return names | {"Brainprint": Instance(kind, lambda: kind(Path(), **checks))}


# Arrays and numbers that are equal on both sides of a page, at least: a row that says no more what it
# said lowers this.
N_EQUAL = {
    "brainprint": 2,
    "lapy": 13,
    "neuromodes": 16,
    "libigl": 14,
    "potpourri3d": 3,
    "pyfm": 1,
}
PEERS = {
    "brainprint": names_of_brainprint,
    "lapy": names_of_lapy,
    "neuromodes": names_of_neuromodes,
    "libigl": names_of_libigl,
    "potpourri3d": names_of_potpourri3d,
    "pyfm": names_of_pyfm,
}


def names_for_geomorph(folder: Path) -> dict[str, Any]:
    """What our code beside geomorph's may use, which is in R and does not run here."""
    morpho, rng = es.morphometrics, np.random.default_rng(0)
    mesh = bumpy_ball()
    points = mesh.vertices[::20]
    n, k = 8, len(points)
    A = points + 0.05 * rng.standard_normal((n, k, 3))
    broken = A.copy()
    broken[3, 2] = np.nan
    normals = np.full(A.shape, np.nan)
    normals[:, 6:] = es.geometry.vertex_normals(mesh)[::20][6:]
    names = [str(number + 1) for number in range(k)]
    mice = {
        mouse: morpho.Landmarks(names, own, curves=[range(6)])
        for mouse, own in zip(("AKR", "DBA"), A, strict=False)
    }
    paths = {}
    for name, suffix in (("tps", ".tps"), ("morphologika", ".txt"), ("fcsv", ".fcsv")):
        paths[f"{name}_path"] = folder / f"mice{suffix}"
        morpho.write_landmarks(mice["AKR"] if name == "fcsv" else mice, paths[f"{name}_path"])
    paths["nts_path"] = folder / "mice.nts"  # read, but not written
    rows = "\n".join(" ".join(map(str, each.points.ravel())) for each in mice.values())
    paths["nts_path"].write_text(f"1 2L {3 * k} 0 DIM=3\nAKR DBA\n{rows}\n")
    es.write_mesh(mesh, folder / "shape.ply")
    scientific = (
        "sklearn.cross_decomposition",
        "sklearn.manifold",
        "scipy.cluster.hierarchy",
        "scipy.spatial.distance",
    )
    modules = {name.split(".")[-1]: import_module(name) for name in scientific}
    return (
        paths
        | modules
        | {
            "es": es,
            "np": np,
            "A": A,
            "X": A.reshape(n, -1),
            "n": n,
            "mesh": mesh,
            "points": points,
            "broken": broken,
            "curves": [[0, 1, 2, 3, 4, 5]],
            "surfaces": [6, 7, 8],
            "template": mice["AKR"],
            "sliders_path": folder / "mice.sliders.csv",
            "normals": normals,
            "groups": np.array(list("aaabbbcc")),
            "land_pairs": [[0, 1], [2, 3]],
            "path": folder / "shape.ply",
            "new_tps_path": folder / "new.tps",
        }
    )


def rows_of(page: str) -> list[list[str]]:
    """Return the cells of each row of the tables of a page, without their heads."""
    lines = (DOCS / f"{page}.md").read_text().splitlines()
    return [
        [cell.strip() for cell in line.strip().strip("|").split("|")]
        for line, following in zip(lines, [*lines[1:], ""], strict=True)
        if line.startswith("|") and not line.startswith("|---") and not following.startswith("|---")
    ]


def run(cell: str, names: dict[str, Any]) -> list[Any]:
    """Return the values of the expressions in a cell; what it assigns is kept for later rows.

    `Class.one`, `two` stands for two methods of a class, `module.one`, `two` for two functions of a module.
    """
    values = []
    owner: Any = None
    for code in re.findall(r"`([^`]+)`", cell):
        if code.isidentifier() and code not in names:
            values.append(getattr(owner, code))
            continue
        if re.match(r"\w+\.\w+", code):
            owner = names[code.split(".")[0]]
        if isinstance(ast.parse(code).body[0], ast.Assign):
            exec(code, names)
            continue
        value = eval(code, names)
        if code.startswith("es.") and isfunction(value):
            arguments, _ = right_arguments(code.split(".")[-1], value, None)
            value = value(**arguments)
        values.append(value)
    return values


def as_numbers(value: Any) -> np.ndarray | None:
    """Return the numbers of an answer, or of the first part of a tuple."""
    if isinstance(value, tuple):
        return as_numbers(value[0])
    if sp.issparse(value):
        return value.toarray()
    if isinstance(value, np.ndarray | float | int) and np.asarray(value).dtype.kind in "iuf":
        return np.squeeze(value)
    return None


def compare_row(
    cells: list[str], theirs: dict[str, Any], ours: dict[str, Any]
) -> tuple[int, list[str]]:
    """Run both sides of a row. Return how many numbers or arrays are equal, and what is wrong."""
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            expected = run(cells[0], theirs)
        except Exception as error:  # noqa: BLE001 - the law is that there is none
            return 0, [f"{cells[0]}: {type(error).__name__}: {error}"]
        try:
            found = run(cells[1], ours)
        except Exception as error:  # noqa: BLE001
            return 0, [f"{cells[1]}: {type(error).__name__}: {error}"]
    if DIFFERENCE.search(cells[1]):
        return 0, []
    # Where one side has more calls than the other, the first ones say the same.
    n_compared = len(found) if len(found) == len(expected) else 1
    n_equal, complaints = 0, []
    for their_value, our_value in zip(expected[:n_compared], found[:n_compared], strict=False):
        there, here = as_numbers(their_value), as_numbers(our_value)
        if there is None or here is None:
            continue
        if there.shape == here.shape and np.allclose(
            there, here, rtol=1e-6, atol=1e-9 * np.abs(there).max()
        ):
            n_equal += 1
        else:
            shown = [f"{each.shape} {each.ravel()[:5]}" for each in (there, here)]
            complaints.append(f"{cells}: {shown[0]} there, {shown[1]} here")
    return n_equal, complaints


@pytest.mark.parametrize("page", PEERS)
def test_every_row_runs(page, tmp_path):
    shared = shared_names(tmp_path)
    try:
        theirs = shared | PEERS[page](shared)
    except ImportError as error:
        pytest.skip(f"{error}")
    ours = our_names(shared)
    outcomes = [compare_row(cells, theirs, ours) for cells in rows_of(page)]
    complaints = [text for _, texts in outcomes for text in texts]
    assert not complaints, "\n".join(complaints)
    assert sum(n_equal for n_equal, _ in outcomes) >= N_EQUAL[page]


def names_for_collections(folder: Path) -> dict[str, Any]:
    """What our code beside that of ALPACA and ShapeWorks may use, which are programs of their own."""
    mesh = bumpy_ball()
    other = es.TriangleMesh(mesh.vertices * [1.1, 1.0, 0.9], mesh.faces)
    (folder / "scans").mkdir()
    given = {}
    third = es.TriangleMesh(mesh.vertices * [1.0, 0.9, 1.1], mesh.faces)
    for name, scan in (("a", mesh), ("b", other), ("c", third)):
        es.write_mesh(scan, folder / "scans" / f"{name}.ply")
        given[name] = es.morphometrics.Landmarks(["1", "2", "3", "4"], scan.vertices[::50])
    es.morphometrics.write_landmarks(given["a"], folder / "a.mrk.json")
    return {
        "es": es,
        "np": np,
        "discriminant_analysis": import_module("sklearn.discriminant_analysis"),
        "folder": folder / "scans",
        "output": folder / "out",
        "landmarks_path": folder / "a.mrk.json",
        "new_path": folder / "new.fcsv",
        "table_path": folder / "all.csv",
        "other_landmarks": given["b"],
        "mesh": mesh,
        "other": other,
        "points": mesh.vertices[:5],
        "rows": [3, 7],
        "path": write_volume(folder, 1),
        "mesh_path": folder / "scans" / "a.ply",
        "new_mesh_path": folder / "new.ply",
        "particles_path": folder / "a_local.particles",
        "shapes": mesh.vertices[:20] + 0.01 * np.random.default_rng(0).standard_normal((4, 20, 3)),
        "groups": ["broad", "broad", "slim", "slim"],
        "labels": ["broad", "slim", "broad"],
    }


@pytest.mark.sweep
def test_every_row_beside_alpaca_and_shapeworks_runs(tmp_path):
    names = names_for_collections(tmp_path)
    # The collection of the first page is that of the second.
    n_values = {
        page: sum(len(run(cell, names)) for _, cell in rows_of(page))
        for page in ("alpaca", "shapeworks")
    }
    assert n_values["alpaca"] > 12
    assert n_values["shapeworks"] > 20
    for path in ("new_path", "table_path", "new_mesh_path", "particles_path"):
        assert names[path].exists()


def test_every_row_beside_geomorph_runs(tmp_path):
    names = names_for_geomorph(tmp_path)
    n_values = 0
    for _, cell in rows_of("geomorph"):
        n_values += len(run(cell, names))
    assert n_values > 25


@pytest.mark.parametrize("page", [*PEERS, "geomorph", "alpaca", "shapeworks"])
def test_few_rows_have_no_code_and_they_say_what_is_missing(page):
    rows = rows_of(page)
    prose = [cells for cells in rows if "`" not in cells[1]]
    assert all("missing" in cells[1] or cells[-1] for cells in prose)
    assert len(prose) < len(rows) / 4


def test_the_anisotropic_operator_of_lapy_is_built_as_its_page_says():
    lapy = pytest.importorskip("lapy")
    text = (DOCS / "lapy.md").read_text()
    block = re.search(r"## Curvature and anisotropy.*?```python\n(.*?)```", text, re.DOTALL)[1]
    mesh = bumpy_ball()
    tria = lapy.TriaMesh(mesh.vertices.copy(), mesh.faces.copy())
    names = {"es": es, "np": np, "mesh": mesh, "tria": tria}
    exec(block, names)
    theirs = lapy.Solver(tria, aniso=2.0)
    for ours, their in (
        (names["laplacian"].stiffness, theirs.stiffness),
        (names["laplacian"].mass, theirs.mass),
    ):
        assert abs(ours - their).max() < 1e-12 * abs(their).max()


def test_bands_of_the_wave_kernel_signature_differ_as_the_page_says():
    from pyFM.signatures.WKS_functions import auto_WKS

    spectrum = es.solve_spectrum(es.cotangent_laplacian(bumpy_ball()), 60)
    logs = np.log(spectrum.eigenvalues[1:])
    width = 7 * np.ptp(logs) / 100
    assert width / es.spectral.default_energies(spectrum, 100)[1] == pytest.approx(1.27)
    equal = auto_WKS(spectrum.eigenvalues, spectrum.eigenvectors, 28)
    assert np.ptp(equal, axis=1).max() < 1e-9 * equal.max()
