"""eigenshape warm-up: compile what the verbs take, before anybody waits for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import eigenshape as es
from eigenshape.cli.console import err, escape_text, out, print_json, print_table, progress_bar

N_VERTICES = 2000  # of a creature: large enough for all that is done with fingers and views


def warm_up(*, as_json: bool = False) -> None:
    """Compile the loops of spectra, search, matching, parts and bending, and keep them on disk.

    Otherwise each loop is compiled when it is first called, which takes some seconds. Run this when
    an image is built or a node of a cluster is set up, as the user and on the kind of CPU that will
    run eigenshape. The environment variable NUMBA_CACHE_DIR names another folder for the loops.
    """
    # It loads numba, for which --help need not wait.
    from eigenshape._compile import cache_folder  # noqa: PLC0415

    seconds: dict[str, float] = {}
    steps = _steps()
    with progress_bar("warm-up") as progress:
        for number, (name, step) in enumerate(steps.items()):
            progress(number / len(steps), name)
            began = perf_counter()
            step()
            seconds[name] = perf_counter() - began
    folder = cache_folder()
    if as_json:
        print_json({"folder": None if folder is None else str(folder), "seconds": seconds})
        return
    rows = [[name, f"{taken:.1f}"] for name, taken in seconds.items()]
    print_table("Compiled", ["work", "seconds"], [*rows, ["all", f"{sum(seconds.values()):.1f}"]])
    if folder is None:
        err.print("[yellow]not kept:[/] no folder for compiled loops can be written to")
    else:
        out.print(f"kept in {escape_text(folder)}")


def _steps() -> dict[str, Callable[[], object]]:
    """Return what is done once, by name: what the verbs of the same names do."""
    mesh, posed = (es.make_creature("biped", pose, n_vertices=N_VERTICES) for pose in (0, 1))
    scan = es.partial_scan(posed, [0.9, 0.25, 0.45]).mesh
    index = es.ShapeIndex.create(None)
    top = mesh.vertices[mesh.vertices[:, 1].argmax()]
    region = es.deformation.BrushRegion(top, 0.5)
    turn = es.Rotation(mesh.vertices.mean(axis=0), [0, 0, 1], 0.4)

    def add() -> None:
        with TemporaryDirectory() as folder:
            es.write_mesh(mesh, Path(folder) / "biped.ply")
            # In a process, whose arrays make signatures of their own
            items, workers = es.io.find_items(folder), es.retrieval.Workers(1)
            es.retrieval.build_index(index, items, es.io.read_surface, workers=workers)

    def search() -> None:
        for match in index.query(scan):
            match.correspondences  # noqa: B018 - computed when asked for

    def spectrum() -> None:
        for operator in (es.cotangent_laplacian(mesh), es.robust_laplacian(mesh)):
            es.solve_spectrum(operator, 50)
        cloud = es.PointCloud(mesh.vertices, dim=2)
        es.solve_spectrum(es.point_cloud_laplacian(cloud), 20)

    return {
        "info, repair": lambda: (es.suggest_repairs(mesh), es.repair(mesh, ["auto"])),
        "spectrum": spectrum,
        "index add": add,
        "query": search,
        "features, segment": lambda: es.find_parts(mesh),
        "match": lambda: es.match_shapes(scan, mesh),
        "deform": lambda: es.deform(es.rig_shape(mesh), region, turn),
    }
