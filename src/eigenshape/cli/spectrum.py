"""eigenshape spectrum: the lowest eigenvalues of a shape by any operator, with their proof."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from jaxtyping import Int

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import err, out, print_json, print_table, print_written, progress_bar
from eigenshape.cli.inputs import (
    CellsOption,
    DimOption,
    DropMissingOption,
    JsonOption,
    RepairOption,
    ShapeArgument,
    load_shape,
)
from eigenshape.cli.outputs import require_output, require_picture, save_picture
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.boundary import Condition
from eigenshape.operators.catalog import OPERATORS, build_laplacian, default_operator
from eigenshape.operators.cotangent import Mass
from eigenshape.operators.fem import fem_boundary_nodes
from eigenshape.operators.gaussian import Distance
from eigenshape.operators.kernel import Correction, Form
from eigenshape.operators.laplacian import Laplacian
from eigenshape.plot.fields import figure_eigenfunctions
from eigenshape.plot.spectra import figure_spectrum
from eigenshape.spectral.bounds.brackets import Brackets, bracket_eigenvalues
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_PICTURED = 8  # eigenfunctions in a picture: two rows of four
USUAL = 20  # pairs
ORDERS = {"p2": 2, "p3": 3}


def spectrum(
    shape: ShapeArgument,
    *,
    k: Annotated[
        int | None,
        typer.Option(
            "-k",
            help=f"Number of eigenpairs, from the lowest one. By default {USUAL}, or all if there are "
            "fewer, unless --below is given.",
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
                f"{', '.join(OPERATORS)} (see `eigenshape operators`). By default cotangent for "
                "meshes, point-cloud for points."
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
        Mass | None, typer.Option(help="Mass matrix of the cotangent operator.")
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
        Correction | None, typer.Option(help="Correct the bias of a kernel operator.")
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
    dim: DimOption = 2,
    drop_missing: DropMissingOption = False,
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
    cache: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps spectra. A spectrum that is in it is read instead of computed."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the lowest eigenvalues of a shape and prove that none is missing."""
    require_picture(picture)
    require_picture(eigenfunctions)
    require_output(output, (".npz",), "A spectrum")
    if accuracy is not None and below is not None:
        raise InvalidParameterError(
            "--accuracy needs -k, because the approximate method cannot count the eigenvalues below a value. Pass -k "
            "instead of --below, or leave out --accuracy."
        )
    scale = {"t": t, "h": h, "edge_factor": edge_factor, "cutoff": cutoff}
    given = {
        "mass": mass,
        "mollify": mollify,
        **scale,
        "correct": correct,
        "form": form,
        "distance": distance,
    }
    options = {name: value for name, value in given.items() if value is not None}
    found = load_shape(shape, repair, dim, drop_missing=drop_missing, cells=cells)
    _require_drawable(found, eigenfunctions)
    bounded = _require_mesh(found) if brackets else None
    name = operator or default_operator(found)
    fixed = _boundary_points(found, ORDERS.get(name, 1)) if boundary == "dirichlet" else None
    with progress_bar("spectrum") as progress:
        progress(0.0, "building the operator")
        laplacian = build_laplacian(found, name, **options)
        n_pairs = _usual_pairs(laplacian, fixed) if k is None and below is None else k
        solved = solve_spectrum(
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
            bracket_eigenvalues(bounded, count, boundary=boundary, progress=progress)
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
                **_facts(solved, bounds),
            }
        )
    else:
        _print(solved, bounds)
    if picture:
        _draw_eigenvalues(found, solved, bounds, picture)
    if eigenfunctions and isinstance(found, TriangleMesh):
        _draw_eigenfunctions(found, solved, eigenfunctions)
    if output:
        solved.save(output)
        print_written(output)


def _usual_pairs(laplacian: Laplacian, fixed: Int[np.ndarray, " c"] | None) -> int:
    """Return the default number of pairs, with a note on stderr if the shape has fewer."""
    most = laplacian.n_points - (0 if fixed is None else len(fixed))
    if most < USUAL:
        err.print(
            f"[yellow]note:[/] the default is {USUAL} pairs; this shape has {most}, and all are computed"
        )
    return max(1, min(USUAL, most))


def _require_drawable(shape: Shape, eigenfunctions: Path | None) -> None:
    if eigenfunctions and not isinstance(shape, TriangleMesh):
        raise InvalidParameterError(
            f"--eigenfunctions draws triangle meshes; the shape is {shape!r}. --picture draws the "
            "eigenvalues of any shape."
        )


def _require_mesh(shape: Shape) -> Mesh:
    if isinstance(shape, PointCloud):
        raise InvalidParameterError("--brackets is for meshes; the shape is a point cloud.")
    return shape


def _boundary_points(shape: Shape, order: int) -> Int[np.ndarray, " c"]:
    if isinstance(shape, PointCloud):
        raise InvalidParameterError(
            "--boundary dirichlet is for meshes; a point cloud has no boundary."
        )
    nodes = fem_boundary_nodes(shape, order)
    if not nodes.size:
        raise InvalidParameterError(f"--boundary dirichlet needs a boundary; {shape!r} is closed.")
    return nodes


def _facts(found: Spectrum, bounds: Brackets | None) -> dict[str, Any]:
    facts = {
        "eigenvalues": found.eigenvalues,
        "residuals": found.residuals,
        "certificate": asdict(found.certificate),
    }
    return facts if bounds is None else {**facts, "brackets": asdict(bounds)}


def _print(found: Spectrum, bounds: Brackets | None) -> None:
    columns, first = ["i", "λ", "error at most"], found.certificate.first
    rows = [
        [str(index), f"{value:.10g}", f"{residual:.1e}"]
        for index, (value, residual) in enumerate(
            zip(found.eigenvalues, found.residuals, strict=True), first
        )
    ]
    if bounds:
        columns += ["lower", "upper"]
        ends = zip(bounds.lower[first:], bounds.upper[first:], strict=True)
        rows = [
            [*row, f"{low:.6g}", f"{high:.6g}"] for row, (low, high) in zip(rows, ends, strict=True)
        ]
    print_table("Eigenvalues, in 1/length²", columns, rows)
    out.print(found.certificate.explain())
    if bounds:
        out.print(bounds.explain())


def _draw_eigenvalues(shape: Shape, found: Spectrum, bounds: Brackets | None, path: Path) -> None:
    area = surface_area(shape) if isinstance(shape, TriangleMesh) else None
    save_picture(figure_spectrum(found, area=area, brackets=bounds), path)


def _draw_eigenfunctions(mesh: TriangleMesh, found: Spectrum, path: Path) -> None:
    first, k = found.certificate.first, len(found.eigenvalues)
    start = min(1, k - 1) if first == 0 else 0  # the lowest is constant
    save_picture(figure_eigenfunctions(mesh, found, range(start, min(k, start + N_PICTURED))), path)
