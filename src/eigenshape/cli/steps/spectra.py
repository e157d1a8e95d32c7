"""What `spectrum` requires of a shape, and what it prints and draws."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from eigenshape._errors import InvalidParameterError
from eigenshape.cli.console import err, out, print_table
from eigenshape.cli.steps.outputs import save_picture
from eigenshape.cli.steps.views import Side
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.catalog import default_operator
from eigenshape.operators.fem import fem_boundary_nodes
from eigenshape.operators.laplacian import Laplacian
from eigenshape.plot.eigenvalues import figure_spectrum
from eigenshape.plot.fields import figure_eigenfunctions
from eigenshape.spectral.bounds.brackets import Brackets
from eigenshape.spectral.spectrum import Spectrum

N_PICTURED = 8  # eigenfunctions in a picture: two rows of four


def limit_pairs(laplacian: Laplacian, fixed: Int[np.ndarray, " c"] | None, k: int) -> int:
    """Return the requested number of pairs, or all with a note on stderr if the shape has fewer."""
    most = max(1, laplacian.n_points - (0 if fixed is None else len(fixed)))
    if most < k:
        err.print(f"[yellow]note:[/] this shape has {most} eigenpairs, not {k}; all are computed")
    return min(k, most)


def operator_name(shape: Shape, requested: str | None) -> str:
    """Return the requested operator, or by default the usual one for the shape."""
    return requested or default_operator(shape)


def require_drawable(shape: Shape, eigenfunctions: Path | None) -> None:
    """Raise an error if eigenfunctions are to be drawn of a shape that is no triangle mesh."""
    if eigenfunctions and not isinstance(shape, TriangleMesh):
        raise InvalidParameterError(
            f"--eigenfunctions draws triangle meshes; the shape is {shape!r}. --picture draws the "
            "eigenvalues of any shape."
        )


def require_bracketable(shape: Shape) -> Mesh:
    """Return a mesh, whose eigenvalues have brackets; raise an error for a point cloud."""
    if isinstance(shape, PointCloud):
        raise InvalidParameterError("--brackets is for meshes; the shape is a point cloud.")
    return shape


def boundary_points(shape: Shape, order: int) -> Int[np.ndarray, " c"]:
    """Return the points of the boundary, of elements of an order; raise an error if there are none."""
    if isinstance(shape, PointCloud):
        raise InvalidParameterError(
            "--boundary dirichlet is for meshes; a point cloud has no boundary."
        )
    nodes = fem_boundary_nodes(shape, order)
    if not nodes.size:
        raise InvalidParameterError(f"--boundary dirichlet needs a boundary; {shape!r} is closed.")
    return nodes


def spectrum_facts(found: Spectrum, bounds: Brackets | None) -> dict[str, Any]:
    """Gather what there is to say about a spectrum and its brackets."""
    facts = {
        "eigenvalues": found.eigenvalues,
        "residuals": found.residuals,
        "certificate": asdict(found.certificate),
    }
    return facts if bounds is None else {**facts, "brackets": asdict(bounds)}


def print_spectrum(found: Spectrum, bounds: Brackets | None) -> None:
    """Print a table of the eigenvalues, and what is proved about them."""
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


def draw_eigenvalues(shape: Shape, found: Spectrum, bounds: Brackets | None, path: Path) -> None:
    """Draw the eigenvalues and their brackets."""
    area = surface_area(shape) if isinstance(shape, TriangleMesh) else None
    save_picture(figure_spectrum(found, area=area, brackets=bounds), path)


def draw_eigenfunctions(mesh: TriangleMesh, found: Spectrum, path: Path, side: Side) -> None:
    """Draw the first eigenfunctions that are not constant."""
    first, k = found.certificate.first, len(found.eigenvalues)
    start = min(1, k - 1) if first == 0 else 0  # the lowest is constant
    chosen = range(start, min(k, start + N_PICTURED))
    save_picture(figure_eigenfunctions(mesh, found, chosen, **side), path)
