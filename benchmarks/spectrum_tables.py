"""The figures of `bench_spectrum.py` as texts of a table, and as one for a terminal."""

from report import Row, ratio_text
from rich.table import Table

HEADER = ("library", "CPU s", "ratio", "wall s", "MiB", "worst residual", "wrong", "missing")


def cells(row: Row) -> tuple[str, ...]:
    """Return the texts of one row; a library without figures says why."""
    if row["status"] != "ok":
        return str(row["library"]), f"{row['status']}: {row['reason']}", *[""] * (len(HEADER) - 2)
    ratio = row.get("ratio")
    return (
        str(row["library"]),
        f"{row['cpu']:.2f}",
        "" if ratio is None else ratio_text(ratio),
        f"{row['wall']:.2f}",
        f"{row['memory']:.0f}",
        f"{row['residual']:.0e}",
        str(row["wrong"]),
        _missing(row),
    )


def _missing(row: Row) -> str:
    """Return both counts where they differ: by comparison, and by inertia below a gap of the list."""
    compared, counted = row["missing"], row["missing_by_inertia"]
    return str(compared) if counted in (compared, None) else f"{compared} ({counted} by inertia)"


def printed(rows: list[Row]) -> Table:
    """Return the table of one case for a terminal."""
    shown = Table(title=title(rows[0]), title_justify="left")
    for place, name in enumerate(HEADER):
        shown.add_column(name, justify="right" if place else "left", overflow="fold")
    for row in rows:
        shown.add_row(*cells(row))
    return shown


def title(row: Row) -> str:
    """Name the case of a row, with how often it was run."""
    runs = len(row.get("cpu_runs", ()))
    return f"{row['title']}, n = {row['n']:,}, k = {row['k']}, {runs} run{'s' * (runs > 1)}"
