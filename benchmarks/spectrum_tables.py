"""The figures of `bench_spectrum.py` as tables for a terminal and for a page."""

from pathlib import Path

from rich.table import Table

TIE = 1.4
BEGIN, END = "<!-- bench_spectrum.py --markdown -->\n", "<!-- end -->\n"
HEADER = ("library", "CPU s", "ratio", "wall s", "MiB", "worst residual", "wrong", "missing")


def cells(row: dict[str, object]) -> tuple[str, ...]:
    """Return the texts of one row; a library without figures says why."""
    if row["status"] != "ok":
        return str(row["library"]), f"{row['status']}: {row['reason']}", *[""] * (len(HEADER) - 2)
    ratio = row.get("ratio")
    return (
        str(row["library"]),
        f"{row['cpu']:.2f}",
        "" if ratio is None else f"{ratio:.1f}" + (" (tie)" if 1 / TIE < ratio < TIE and ratio != 1 else ""),
        f"{row['wall']:.2f}",
        f"{row['memory']:.0f}",
        f"{row['residual']:.0e}",
        str(row["wrong"]),
        _missing(row),
    )


def _missing(row: dict[str, object]) -> str:
    """Return both counts where they differ: by comparison, and by inertia below a gap of the list."""
    compared, counted = row["missing"], row["missing_by_inertia"]
    return str(compared) if counted in (compared, None) else f"{compared} ({counted} by inertia)"


def printed(rows: list[dict[str, object]]) -> Table:
    """Return the table of one case for a terminal."""
    table = Table(title=_title(rows[0]), title_justify="left")
    for place, name in enumerate(HEADER):
        table.add_column(name, justify="right" if place else "left", overflow="fold")
    for row in rows:
        table.add_row(*cells(row))
    return table


def _title(row: dict[str, object]) -> str:
    runs = len(row.get("cpu_runs", ()))
    return f"{row['title']}, n = {row['n']:,}, k = {row['k']}" + (
        f" ({runs} run{'s' * (runs > 1)})" if runs != 3 else ""
    )


def measured_on(report: dict[str, object]) -> str:
    """Say when and on what a report was measured, in one paragraph."""
    machine = report["machine"]
    versions = [f"{name} {number}" for name, number in machine["versions"].items() if number]
    return (
        f"Measured {report['date']} on one of {machine['cores']} cores, {machine['cpu']}, {machine['memory_gib']} GiB, "
        f"load {machine['load'][0]} at the start; {machine['system']}, Python {machine['python']}; "
        f"{', '.join([*versions, *machine['blas']])}. Medians of three unless the table says so."
    )


def markdown(report: dict[str, object]) -> str:
    """Return the whole report as a page's section."""
    lines = [
        measured_on(report),
        "",
        f"| shape | {' | '.join(HEADER)} |",
        "|" + "---|" * (len(HEADER) + 1),
    ]
    before = None
    for row in report["rows"]:
        lines.append(f"| {_title(row) if row['case'] != before else ''} | {' | '.join(cells(row))} |")
        before = row["case"]
    return "\n".join(lines) + "\n"


def put(path: Path, text: str, begin: str = BEGIN) -> None:
    """Write a section to a file; where the file has the two marks, between them."""
    page = path.read_text() if path.exists() else ""
    if begin in page and END in page.split(begin)[1]:
        before, rest = page.split(begin)
        text = before + begin + "\n" + text + "\n" + END + rest.split(END, 1)[1]
    path.write_text(text)
