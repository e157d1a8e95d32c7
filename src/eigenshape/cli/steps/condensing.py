"""Regions of similar heat of one file, in a worker, and the table of the regions of all."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np

from certeig.kit.files import replace_file
from eigenshape._extras import import_extra
from eigenshape._workers import run_in_workers
from eigenshape.cli.steps.writing import require_output
from eigenshape.features.condensed import condense
from eigenshape.io.surface_files import read_surface
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.spectral.signatures.approximate_heat import LARGE, approximate_heat_signature
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum

__all__ = ["run_in_workers"]  # for the verb, as it is, beside what is defined here

TABLES = (".csv", ".parquet")
CUT_OFF = 0.01  # the most that e^{-tλ} of the last mode may be at the shortest time, without a note
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class RegionTable:
    """The regions of a file: columns of equal length, and how exact they are."""

    columns: Columns
    n_regions: int
    lost: float
    error: float
    notes: tuple[str, ...]


def condense_file(
    times: Sequence[float], n_modes: int, tolerance: float, repairs: Sequence[str], path: Path
) -> RegionTable:
    """Average the heat of a file over regions."""
    done = read_surface(path, repair=repairs)
    mesh, notes = done.mesh, done.report
    laplacian = cotangent_laplacian(mesh)
    k = min(n_modes, mesh.n_vertices)
    if mesh.n_vertices > LARGE:
        found = approximate_heat_signature(laplacian, k, times)
        heat, last, error = found.values, found.eigenvalues[-1], float(found.errors.max())
    else:
        spectrum = solve_spectrum(laplacian, k)
        heat, last, error = heat_kernel_signature(spectrum, times), spectrum.eigenvalues[-1], 0.0
    left = float(np.exp(-last * min(times)))
    if left > CUT_OFF and k < mesh.n_vertices:
        needed = -np.log(CUT_OFF) / last
        notes += (
            f"{k} modes end too early for the time {min(times):g}: that of the last one has only "
            f"fallen to {left:.2g} by then; take times from {needed:.2g} on, or more modes",
        )
    regions = condense(mesh, np.log(heat), tolerance)
    columns = regions.table([f"log_heat_{time:g}" for time in times])
    return RegionTable(columns, len(regions.areas), regions.lost, error, notes)


def join_tables(shapes: Sequence[tuple[str, RegionTable]]) -> Columns:
    """Return the tables of all shapes as one, with the name of the shape in the first column."""
    names = np.repeat([name for name, _ in shapes], [table.n_regions for _, table in shapes])
    first = shapes[0][1].columns
    return {
        "shape": names,
        **{name: np.concatenate([table.columns[name] for _, table in shapes]) for name in first},
    }


def require_table(path: Path) -> None:
    """Raise an error, before anything is computed, if a table cannot be written to the path."""
    require_output(path, TABLES, "A table")
    if path.suffix.lower() == ".parquet":
        import_extra("pyarrow.parquet", "pyarrow")


def write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write columns as CSV, whose numbers read back exactly, or as Parquet."""
    if path.suffix.lower() == ".parquet":
        arrow: Any = import_extra("pyarrow", "pyarrow")
        data = BytesIO()
        import_extra("pyarrow.parquet", "pyarrow").write_table(arrow.table(dict(columns)), data)
        replace_file(path, data.getvalue())
        return
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    replace_file(path, text.getvalue().encode())
