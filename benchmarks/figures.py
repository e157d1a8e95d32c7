"""The figures of the pages: measure them, write their tables, check them, and name those older than the code.

    python benchmarks/figures.py                      check all pages; the house tests do the same
    python benchmarks/figures.py --tables EXPECTED RUN
                                                      print a README's tables with the figures of another run
    python benchmarks/figures.py --run [NAME ...]     measure, all or some, the most important first, and write
    python benchmarks/figures.py --run --minutes 35   the same, and begin nothing further after 35 minutes
    python benchmarks/figures.py --write              write all tables from their files
    python benchmarks/figures.py --stale              name the figures that are older than the code that they time

A benchmark writes `figures/NAME.json`: the command, the day, the commit, the machine, the versions, all rows, and the
texts of the table. A page shows it between `<!-- figures: NAME -->` and `<!-- end -->`. One file is one run on one
machine, and so is a table. A run that fails leaves the file of the run before.

An experiment writes its figures with `--out`. The tables of its README name the file and the place of each number in a
comment above them, and sentences that repeat a number do so in a comment of the page, `<!-- sentences: FILE>PATH`.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FOLDER = Path(__file__).with_name("figures")
PAGES = [
    ROOT / "README.md",
    *(
        page
        for page in sorted((ROOT / "docs").rglob("*.md"))
        if not {"api", "experiments", "_build"}
        & {*page.parts[len(ROOT.parts) :]}  # made by a build
    ),
    *sorted((ROOT / "experiments").rglob("*.md")),
]
MEASURED = re.compile(r"<!-- figures: (\w+) -->\n(.*?)<!-- end -->\n", re.DOTALL)
# A table of an experiment: the file and a path in it, the key of each row, and the cells with paths below it.
FILLED = re.compile(r"( *<!-- figures: (\S+\.json.*)\n *(.*)\n *(.*) -->\n)((?: *\|.*\n)+)")
# Sentences with figures of an experiment: the file and a path in it, and a line for each with paths below it.
SENTENCES = re.compile(r"<!-- sentences: (\S+\.json.*)\n((?:.*\n)*?)-->\n")
PLACE = re.compile(r"\{(.*?)(?::([z+,]*(?:\.\d[efg%])?))?\}")
# Why a table with numbers may have no file of figures: its comment, `<!-- no figures: WHY -->`, says one of these.
NO_FIGURES = {
    "numbers are names, sections or parameters",
    "values printed in the thesis",
    "exact values",
}
COMMENTED = re.compile(r"<!-- no figures: (.*) -->\n\Z")
TABLE = re.compile(r"(?:^ *\|.*\n){3,}", re.MULTILINE)
NOT_NUMBERS = re.compile(r"`[^`]*`|\]\([^)]*\)")
NUMBER = re.compile(r"(?<![\w.^])\d")


@dataclass(frozen=True)
class Figure:
    """A benchmark with its options, and the files that it times."""

    command: str
    times: tuple[str, ...]


SOURCE = "src/eigenshape/"
SOLVER = ("spectral/solve.py", "../../certeig/src/certeig")
HEAT = ("spectral/multilevel", "spectral/signatures", "features")
DESCRIBING = ("retrieval/patches", "retrieval/heat")
STORE = ("retrieval/store", "retrieval/search")
# The most important first, so that what there is time for is measured: some forty minutes on two idle cores.
FIGURES = {
    "spectrum": Figure(
        "bench_spectrum.py --cases sphere-40k,sphere-160k,octopus,airplane,dragon "
        "--libraries lapy,cholespy,pardiso --repeats 1",
        SOLVER,
    ),
    "libraries": Figure("bench_spectrum.py --cases sphere-10k,graph-sphere --repeats 1", SOLVER),
    "cortex": Figure("bench_cortex.py --repeats 1", ("modes", "compat", *SOLVER)),
    "calls": Figure("bench_calls.py", ("operators", "matching", "spectral")),
    "start": Figure("bench_start.py", ("__init__.py", "cli")),
    "size": Figure("bench_size.py --repeats 1", ("../../pyproject.toml",)),
    "threads": Figure("bench_threads.py", SOLVER),
    "soak_calls": Figure("soak.py calls", ("_sealed.py", "matching", "deformation", *SOLVER)),
    "soak_service": Figure(
        "soak.py service", (*STORE, "../../studio/src/eigenshape_studio/service")
    ),
    "search": Figure("bench_search.py --queries 20 --qdrant 0", STORE),
    "retrieval": Figure("bench_retrieval.py --repeats 1", DESCRIBING),
    "deform": Figure("bench_deform.py --repeats 1", ("deformation",)),
    "characters": Figure("bench_characters.py --repeats 1", ("deformation", "io")),
    "kernel": Figure("bench_kernel.py --repeats 1", ("operators",)),
    "approximate": Figure(
        "bench_approximate.py --cases dragon sphere-160k kernel-20k",
        ("spectral/multilevel", *SOLVER),
    ),
    "transport": Figure("bench_transport.py --repeats 1", ("calculus", "geometry")),
    "calculus": Figure("bench_calculus.py --repeats 1", ("calculus",)),
    "factor": Figure("bench_factor.py --sizes 5 6 160000", SOLVER),
    "parts": Figure("bench_parts.py", SOLVER),
    "merge": Figure("bench_merge.py --repeats 1", ("features",)),
    "tetrahedra": Figure("bench_tetrahedra.py --repeats 1", ("operators", *SOLVER)),
    "growth": Figure("bench_growth.py --only points pairs kernel --repeats 1", SOLVER),
    "features": Figure("bench_features.py --repeats 1", (*HEAT, *SOLVER)),
    "first_call": Figure("bench_first_call.py --repeats 1", SOLVER),
    "peers": Figure(
        "bench_approximate.py --peers --cases sphere-20k-20 sphere-100k-20 dragon-20",
        ("spectral/multilevel",),
    ),
    "index": Figure("bench_index.py --sizes 10000", STORE),
    "service": Figure("bench_service.py --minutes 1", ("retrieval/store", "../../studio/src")),
    "build": Figure("bench_build.py", STORE),
    "studio": Figure(
        "bench_studio.py --only drag --only opening --only report",
        ("../../studio", "deformation"),
    ),
    "studio_sizes": Figure("bench_studio.py --only sizes", ("../../studio",)),
    "ugly": Figure(
        "bench_ugly.py --only nasty --limit 600", ("geometry/repairs", "io", "operators")
    ),
    "encodings": Figure("bench_torch.py --only encodings", ("torch",)),
    "bundles": Figure("bench_torch.py --only operators", ("spectral/tools/bundle.py", *SOLVER)),
    "torch": Figure(
        "bench_torch.py --only gradients --only memory --only awkward --only damaged",
        ("torch", "spectral/tools", *SOLVER),
    ),
    "interop": Figure("bench_interop.py", ("io",)),
    "million": Figure("bench_search.py --sizes 1000000 --queries 10 --qdrant 0 --faiss 0", STORE),
}
# Measured only if they are named: an hour and 65 GB of disk; nine programs, of which most are not installed here
LARGE = {"million", "interop"}


def load(name: str) -> dict[str, Any] | None:
    """Read the figures of one run, if there are any."""
    path = FOLDER / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def measured_on(figures: dict[str, Any]) -> str:
    """Say when, by which command and on which machine figures were measured, in one paragraph."""
    machine, settings = figures["machine"], figures["settings"]
    versions = [f"{name} {number}" for name, number in machine["versions"].items() if number]
    parts = [
        f"Measured {figures['date']} by `{figures['command']}` at commit {figures['commit']}",
        f"on {machine['cpu']}, {machine['threads']} of {machine['cores']} cores, {machine['memory_gib']} GiB",
        f"load {machine['load'][0]} at the start",
        *([settings["speed"]] if "speed" in settings else []),
        f"{machine['system']}, Python {machine['python']}",
        *versions,
        *machine["blas"],
    ]
    repeats = settings["repeats"]
    runs = f"Medians of {repeats} unless the table says so." if repeats > 1 else "One run each."
    return f"{', '.join(parts)}. {runs}"


def table(columns: list[str], rows: list[list[str]]) -> str:
    """Return a table for a page; a first cell that repeats the one above it is left empty."""
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    before = None
    for first, *others in rows:
        lines.append(f"| {' | '.join(['' if first == before else first, *others])} |")
        before = first
    return "\n".join(lines) + "\n"


def block(name: str) -> str:
    """Return what a page shows of some figures."""
    figures = load(name)
    if figures is None:
        shown = (
            f"Not measured since its code changed: `python benchmarks/figures.py --run {name}`.\n"
        )
    else:
        shown = f"{measured_on(figures)}\n\n{table(figures['columns'], figures['table'])}"
    return f"<!-- figures: {name} -->\n\n{shown}\n<!-- end -->\n"


def written(text: str, folder: Path) -> str:
    """Return a page with all tables written anew from their files."""
    text = MEASURED.sub(lambda found: block(found[1]), text)
    return FILLED.sub(lambda found: found[1] + filled(folder, *found.groups()[1:]), text)


def filled(folder: Path, root: str, keys: str, cells: str, rows: str) -> str:
    """Return a table of an experiment with the numbers of its file."""
    return fill_rows(figures_at(folder, root), keys, cells, rows)


def figures_at(folder: Path, root: str) -> Any:
    """Return what stands in a file beside a page at a path: `expected.json>full`."""
    file, *path = root.split(">")
    return look_up(json.loads((folder / file).read_text(encoding="utf-8")), path)


def fill_rows(results: Any, keys: str, cells: str, rows: str) -> str:
    """Return a table with the numbers of results."""
    head, line, *old = rows.splitlines()
    lines, margin = [head, line], line[: line.index("|")]
    for key, row in zip(keys.split(" | "), old, strict=True):
        kept = split_row(row)
        fresh = [
            cell if template == "=" else fill(template, key, results, cell)
            for template, cell in zip(cells.split(" | "), kept, strict=True)
        ]
        lines.append(f"{margin}| {' | '.join(fresh)} |")
    return "\n".join(lines) + "\n"


def tables_of_run(expected: Path, run: Path) -> str:
    """Return the tables that a README fills from its file of expected figures, with those of a run instead."""
    page = expected.with_name("README.md").read_text(encoding="utf-8")
    found = json.loads(run.read_text(encoding="utf-8"))
    tables = []
    for _, root, keys, cells, rows in FILLED.findall(page):
        file, _, *path = root.split(">")  # a run's figures stand in its file without "full"
        if file != expected.name:
            continue
        try:
            table = fill_rows(look_up(found, path), keys, cells, rows)
        except LookupError:  # the run measured nothing of this table
            continue
        head, line, *filled_rows = table.splitlines()
        measured = [
            row
            for row in filled_rows
            if any(
                cell
                for cell, template in zip(split_row(row), cells.split(" | "), strict=True)
                if "{" in template and template != "{#}"
            )
        ]
        if measured:
            tables.append("\n".join([head, line, *measured, ""]))
    return "\n".join(tables)


def split_row(row: str) -> list[str]:
    """Return the cells of a row."""
    return [cell.strip() for cell in row.strip()[1:-1].split("|")]


def fill(template: str, key: str, results: Any, cell: str) -> str:
    """Return the text of one cell; the words that stand there if the results have nothing for it."""

    def number(found: re.Match[str]) -> str:
        path, form = found.groups()
        if path == "#":
            return key.rsplit(">", maxsplit=1)[-1]
        stars, names = path.count("*"), key.split(">")
        if stars == 0:
            path = f"{key}>{path}"
        elif stars == len(names):
            path = path.replace("*", "{}").format(*names)
        else:
            path = path.replace("*", key)
        return number_text(results, path, form)

    try:
        return PLACE.sub(number, template)
    except LookupError:
        return "" if NUMBER.search(cell) else cell


def number_text(results: Any, path: str, form: str | None) -> str:
    """Return the number at a path as text."""
    value = look_up(results, path.split(">"))
    if value is None:
        raise KeyError(path)
    return value if isinstance(value, str) else format(value, form or "").removesuffix("%")


def sentences(text: str, folder: Path) -> list[str]:
    """Return the sentences that a page must hold, with the figures of their files."""
    return [
        fill_sentence(template, figures_at(folder, root))
        for root, templates in SENTENCES.findall(text)
        for template in templates.splitlines()
    ]


def fill_sentence(template: str, results: Any) -> str:
    """Return a sentence with the numbers of results."""
    return PLACE.sub(lambda place: number_text(results, *place.groups()), template)


def look_up(results: Any, path: list[str]) -> Any:
    """Return what stands at a path of names and places."""
    for name in path:
        results = results[int(name)] if isinstance(results, list) else results[name]
    return results


def complaints(page: Path) -> list[str]:
    """Say what is wrong with the tables of a page: no source, or other than its file would write it."""
    text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT)
    anew = written(text, page.parent).splitlines()
    found = [
        f"{name}:{number}: {line!r} is {fresh!r} in its file; run benchmarks/figures.py --write"
        for number, (line, fresh) in enumerate(zip(text.splitlines(), anew, strict=False), 1)
        if line != fresh
    ][:3]
    plain = " ".join(SENTENCES.sub("", text).split())
    found += [
        f"{name}: it must say, as its file does: {sentence}"
        for sentence in sentences(text, page.parent)
        if sentence not in plain
    ]
    for _, _, _, cells, rows in FILLED.findall(text):
        heads, _, *table_rows = map(split_row, rows.splitlines())
        for place, (head, template) in enumerate(zip(heads, cells.split(" | "), strict=True)):
            kept = place > 0 and template == "=" and "printed" not in head  # printed in the thesis
            if kept and any(re.match(r"[-+]?\d", row[place]) for row in table_rows):
                found.append(f"{name}: numbers without a source in the column {head}")
    rest = FILLED.sub("\n", MEASURED.sub("\n", text))
    for each in TABLE.finditer(rest):
        head, _, *rows = each[0].splitlines()
        if not NUMBER.search(NOT_NUMBERS.sub("", "\n".join(rows))):
            continue
        reason = COMMENTED.search(rest, 0, each.start())
        if reason is None:
            found.append(f"{name}: numbers without a source in the table {head}")
        elif reason[1] not in NO_FIGURES:
            found.append(f"{name}: {reason[1]!r} is no reason; it must be one of {NO_FIGURES}")
    return found


def run(name: str) -> None:
    """Measure one set of figures; a run that fails keeps those of the run before."""
    figure = FIGURES[name]
    script, *options = figure.command.split()
    print(f"== {name}: {figure.command}", flush=True)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "figures.json"
        command = [sys.executable, str(FOLDER.parent / script), *options, "--json", str(out)]
        subprocess.run(command, cwd=ROOT, check=True)
        text = out.read_text(encoding="utf-8")
    times = [os.path.normpath(SOURCE + path) for path in figure.times]
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.json").write_text(
        text.replace("{\n", f'{{\n "times": {json.dumps(times)},\n', 1), encoding="utf-8"
    )
    print(f"== {name}: {time.perf_counter() - start:.0f} s", flush=True)


def write() -> None:
    """Write the tables of all pages from their files."""
    for page in PAGES:
        before = page.read_text(encoding="utf-8")
        if (after := written(before, page.parent)) != before:
            page.write_text(after, encoding="utf-8")
            print(f"wrote {page.relative_to(ROOT)}")


def stale() -> list[str]:
    """Name the figures whose code has changed since, or why that is not known."""
    found = []
    for path in sorted(FOLDER.glob("*.json")):
        figures = json.loads(path.read_text(encoding="utf-8"))
        since = f"{figures['commit'].split()[0]}..HEAD"
        command = ["git", "log", "--format=%h", since, "--", *figures["times"]]
        try:
            done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            found.append(f"{path.stem}: age not known, since commit {since[:-6]} is not here")
            continue
        if commits := done.stdout.split():
            found.append(
                f"{path.stem}, of {figures['date']}, is older than what it times: "
                f"{len(commits)} commits since {since[:-6]} in {', '.join(figures['times'])}"
            )
    return found


def main() -> None:
    """Do what the options ask for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--run", nargs="*", choices=FIGURES, help="measure all but the largest, or these"
    )
    parser.add_argument(
        "--minutes", type=float, default=float("inf"), help="after which nothing further is begun"
    )
    parser.add_argument("--write", action="store_true", help="write all tables from their files")
    parser.add_argument("--stale", action="store_true", help="name figures older than their code")
    parser.add_argument(
        "--tables",
        nargs=2,
        type=Path,
        metavar=("EXPECTED", "RUN"),
        help="print the tables of a README that name this file, with the figures of a run's --out",
    )
    options = parser.parse_args()
    failed = []
    if options.run is not None:
        end = time.monotonic() + 60 * options.minutes
        for name in options.run or [name for name in FIGURES if name not in LARGE]:
            if time.monotonic() > end:
                failed.append(f"{name} was not begun: the time is over")
                continue
            try:
                run(name)
            except subprocess.CalledProcessError:
                failed.append(f"{name} failed; its figures are those of the run before")
            write()
    elif options.tables:
        print(tables_of_run(*options.tables))
    elif options.write:
        write()
    elif options.stale:
        print("\n".join(stale()))
    else:
        failed = [line for page in PAGES for line in complaints(page)]
    sys.exit("\n".join(failed) or None)


if __name__ == "__main__":
    main()
