"""eigenshape spectrum: the lowest eigenvalues of a shape by any operator, with their proof."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import eigenshape as es
from eigenshape._errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, print_written, progress_bar
from eigenshape.cli.inputs import (
    CellsOption,
    DimOption,
    JsonOption,
    RepairOption,
    ShapeArgument,
    UpOption,
    ViewOption,
)
from eigenshape.operators.choices import Condition, Distance, Form, Mass

USUAL = 20  # pairs
ORDERS = {"p2": 2, "p3": 3}


def spectrum(
    shape: ShapeArgument,
    *,
    k: Annotated[
        int | None,
        typer.Option(
            "-k",
            help=f"Number of eigenpairs, from the lowest one, or all if there are fewer. By default "
            f"{USUAL}, unless --below is given.",
        ),
    ] = None,
    below: Annotated[
        float | None,
        typer.Option(help="Instead of -k: all eigenvalues below this value, in 1/length²."),
    ] = None,
    above: Annotated[
        float | None,
        typer.Option(help="With --below: only eigenvalues from this value on, in 1/length²."),
    ] = None,
    operator: Annotated[
        str | None,
        typer.Option(
            "--operator",
            help=(
                "One of those that `eigenshape operators` lists. By default cotangent for meshes, "
                "point-cloud for points."
            ),
        ),
    ] = None,
    accuracy: Annotated[
        float | None,
        typer.Option(
            help=(
                "Compute approximately, which is faster but proves nothing. Errors are at most this "
                "share of the largest eigenvalue, such as 1e-3."
            )
        ),
    ] = None,
    boundary: Annotated[
        Condition,
        typer.Option(
            help="Boundary condition: neumann leaves the boundary free, dirichlet fixes it at 0."
        ),
    ] = "neumann",
    brackets: Annotated[
        bool,
        typer.Option(
            "--brackets",
            help="Also compute guaranteed lower and upper bounds of the eigenvalues of the mesh itself.",
        ),
    ] = False,
    mass: Annotated[
        Mass | None,
        typer.Option(
            help="Mass matrix of the cotangent operator: by default averaged for tetrahedra, and "
            "otherwise lumped."
        ),
    ] = None,
    t: Annotated[
        float | None, typer.Option(help="Heat time of a kernel operator, in length².")
    ] = None,
    h: Annotated[
        float | None, typer.Option(help="Instead of --t: width of the kernel, 2√t, in length.")
    ] = None,
    edge_factor: Annotated[
        float | None, typer.Option(help="Instead of --t: width of the kernel in mean edge lengths.")
    ] = None,
    correct: Annotated[
        Literal["log", "none"] | None,
        typer.Option(
            help="Whether to correct the bias of a kernel operator: by default on points, not on meshes."
        ),
    ] = None,
    form: Annotated[
        Form | None,
        typer.Option(help="Mass matrix of a kernel operator; random-walk copes with noise."),
    ] = None,
    distance: Annotated[
        Distance | None, typer.Option(help="Distance that the kernel of the mesh operator uses.")
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option(help="Distance at which a kernel is cut off, in widths.")
    ] = None,
    mollify: Annotated[
        float | None,
        typer.Option(
            help="Smallest height that the robust operator allows in a triangle, in mean edge lengths. "
            "By default 1e-5."
        ),
    ] = None,
    n_neighbors: Annotated[
        int | None,
        typer.Option(
            help="Neighbors of each point of a cloud among which the robust operator seeks triangles. "
            "By default 30."
        ),
    ] = None,
    dim: DimOption = 2,
    cells: CellsOption = None,
    repair: RepairOption = "",
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Write eigenvalues, eigenvectors and the proof (NPZ; Spectrum.load reads it).",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the eigenvalues (PNG, SVG or PDF).")
    ] = None,
    eigenfunctions: Annotated[
        Path | None,
        typer.Option(
            help="Draw the first eigenfunctions of a triangle mesh with their nodal lines (PNG, "
            "SVG or PDF)."
        ),
    ] = None,
    view: ViewOption = "auto",
    up: UpOption = "auto",
    cache: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps spectra. A spectrum that is in it is read instead of computed."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the lowest eigenvalues of a shape and prove that none is missing."""
    steps.require_picture(picture)
    steps.require_picture(eigenfunctions)
    side = steps.parse_side(view, up)
    steps.require_output(output, (".npz",), "A spectrum")
    if accuracy is not None and below is not None:
        raise InvalidParameterError(
            "--accuracy needs -k, because the approximate method cannot count the eigenvalues below a value. Pass -k "
            "instead of --below, or leave out --accuracy."
        )
    scale = {"t": t, "h": h, "edge_factor": edge_factor, "cutoff": cutoff}
    given = {
        "mass": mass,
        "mollify": mollify,
        "n_neighbors": n_neighbors,
        **scale,
        "correct": correct,
        "form": form,
        "distance": distance,
    }
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if correct == "none":
        options["correct"] = None
    found = steps.load_shape(shape, repair, dim, cells)
    steps.require_drawable(found, eigenfunctions)
    bounded = steps.require_bracketable(found) if brackets else None
    name = steps.operator_name(found, operator)
    if accuracy is not None and name == "cotangent":
        options.setdefault("mass", "lumped")  # approximate eigenpairs need a diagonal
    fixed = steps.boundary_points(found, ORDERS.get(name, 1)) if boundary == "dirichlet" else None
    with progress_bar("spectrum") as progress:
        progress(0.0, "building the operator")
        laplacian = es.build_laplacian(found, operator, **options)
        if name == "point-cloud" and laplacian.kernel is None:
            name = "robust"  # as a warning says
        wanted = USUAL if k is None and below is None else k
        n_pairs = None if wanted is None else steps.limit_pairs(laplacian, fixed, wanted)
        solved = es.solve_spectrum(
            laplacian,
            n_pairs,
            fixed=fixed,
            above=above,
            below=below,
            method="certified" if accuracy is None else "approximate",
            accuracy=accuracy,
            progress=progress,
            cache=cache,
        )
        count = solved.certificate.first + len(solved.eigenvalues)
        bounds = (
            es.bracket_eigenvalues(bounded, count, boundary=boundary, progress=progress)
            if bounded
            else None
        )
    if as_json:
        print_json(
            {
                "path": str(shape),
                "operator": name,
                "boundary": boundary,
                **options,
                **steps.spectrum_facts(solved, bounds),
            }
        )
    else:
        steps.print_spectrum(solved, bounds)
    if picture:
        steps.draw_eigenvalues(found, solved, bounds, picture)
    if eigenfunctions and isinstance(found, es.TriangleMesh):
        steps.draw_eigenfunctions(found, solved, eigenfunctions, side)
    if output:
        solved.save(output)
        print_written(output)
