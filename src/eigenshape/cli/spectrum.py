"""eigenshape spectrum: the lowest eigenvalues of a mesh, with their proof."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from eigenshape.cli.console import (
    JsonOption,
    MeshArgument,
    RepairOption,
    load_mesh,
    out,
    print_json,
    print_table,
    progress_bar,
    said,
)
from eigenshape.figures.fields import figure_eigenfunctions
from eigenshape.figures.save import require_picture_path, save_figure
from eigenshape.figures.spectra import figure_spectrum
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import Mass, cotangent_laplacian
from eigenshape.spectral.solver import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

N_PICTURED = 8


def spectrum(
    mesh: MeshArgument,
    *,
    k: Annotated[int, typer.Option("-k", help="Number of eigenpairs.")] = 20,
    mass: Annotated[Mass, typer.Option(help="Mass matrix of the cotangent Laplacian.")] = "lumped",
    repair: RepairOption = "",
    plot: Annotated[Path | None, typer.Option(help="Draw the eigenvalues (PNG, SVG or PDF).")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the first eigenfunctions with their nodal lines (PNG, SVG or PDF).")
    ] = None,
    save: Annotated[Path | None, typer.Option(help="Write eigenvalues and eigenvectors (NumPy .npz).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the lowest eigenvalues of a mesh and prove that none is missing."""
    for path in filter(None, (plot, picture)):
        require_picture_path(path)
    surface = load_mesh(mesh, repair)
    with progress_bar("spectrum") as progress:
        found = solve_spectrum(cotangent_laplacian(surface, mass), k, progress=progress)
    if as_json:
        print_json({"path": str(mesh), "mass": mass, **_facts(found)})
    else:
        _print(found)
    _write(surface, found, plot=plot, picture=picture, save=save)


def _facts(found: Spectrum) -> dict[str, object]:
    return {
        "eigenvalues": found.eigenvalues,
        "residuals": found.residuals,
        "certificate": asdict(found.certificate),
    }


def _print(found: Spectrum) -> None:
    rows = [
        [str(index), f"{value:.10g}", f"{residual:.1e}"]
        for index, (value, residual) in enumerate(zip(found.eigenvalues, found.residuals, strict=True))
    ]
    print_table("Eigenvalues, in 1/length²", ["i", "λ", "error at most"], rows)
    out.print(found.certificate.explain())


def _write(
    surface: TriangleMesh, found: Spectrum, *, plot: Path | None, picture: Path | None, save: Path | None
) -> None:
    if plot:
        area = surface_area(surface)
        save_figure(figure_spectrum(found.eigenvalues, area=area, shift=found.certificate.shift), plot)
        said(plot)
    if picture:
        k = len(found.eigenvalues)
        indices = range(min(1, k - 1), min(k, N_PICTURED + 1))
        save_figure(figure_eigenfunctions(surface, found, indices), picture)
        said(picture)
    if save:
        np.savez_compressed(
            save, eigenvalues=found.eigenvalues, eigenvectors=found.eigenvectors, residuals=found.residuals
        )
        said(save)
