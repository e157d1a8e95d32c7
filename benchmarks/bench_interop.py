r"""Let other programs write ten shapes and read ours, and compare coordinates, areas, colors and fields.

    python benchmarks/bench_interop.py                                    # all programs that are installed
    python benchmarks/bench_interop.py --tools trimesh,meshio             # some
    python benchmarks/bench_interop.py --environments ~/interop           # Pythons and node_modules of their own
    python benchmarks/bench_interop.py --keep FOLDER                      # keep the files, to look at them

A program whose Python package is not installed beside eigenshape runs in FOLDER/NAME/bin/python of `--environments`;
JavaScript packages lie in FOLDER/npm/node_modules:

    python -m venv ~/interop/blender && ~/interop/blender/bin/pip install bpy
    npm install --prefix ~/interop/npm three meshoptimizer @gltf-transform/core @gltf-transform/extensions \
        @gltf-transform/functions

There are three ways: the program writes and eigenshape reads; eigenshape writes and the program reads; the program
writes, eigenshape reads and writes again with all attributes, and the program reads. All programs that know a format
read its files, so that a difference has witnesses. It is

- equal, if all that the file can hold is what it should be;
- named, if an error or a warning of eigenshape says so;
- theirs, if no other program finds the right values in a file that the program wrote, or another program finds
  them in a file that eigenshape wrote;
- silent in all other cases, and then the script ends with an error.
"""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Set
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from interop.compare import compare
from interop.here import listen, read_here, write_again, write_here
from interop.shapes import make_shapes
from report import dump, new_figures, options_of

TOOLS = {
    "trimesh": "trimesh", "vtk": "pyvista", "meshio": "meshio", "pygltflib": "pygltflib", "open3d": "open3d",
    "meshlab": "pymeshlab", "blender": "bpy", "three": "three", "gltf_transform": "@gltf-transform/core",
}  # fmt: skip
TITLES = {
    "trimesh": "trimesh", "vtk": "PyVista", "meshio": "meshio", "pygltflib": "pygltflib", "open3d": "Open3D",
    "meshlab": "MeshLab", "blender": "Blender", "three": "three.js", "gltf_transform": "glTF Transform",
}  # fmt: skip
FOLDER = Path(__file__).with_name("interop")
# The shapes that eigenshape writes, by suffix.
OURS = {
    ".ply": ("prism", "seam", "colors", "fields", "far"),
    ".obj": ("prism", "seam", "colors", "far"),
    ".off": ("prism", "far"),
    ".stl": ("prism", "far"),
    ".glb": ("prism", "seam", "colors", "far"),
    ".vtu": ("prism", "fields", "solids", "curves", "far"),
    ".vtk": ("prism", "fields", "far"),
    ".vtp": ("prism", "fields", "far"),
}
# The suffix in which a file with attributes is written again.
AGAIN = {".glb": ".glb", ".gltf": ".glb", ".obj": ".obj", ".ply": ".ply"}
# What formats cannot hold, by the beginning of an aspect.
CANNOT = {
    ".stl": ("texture", "colors", "field"),
    ".off": ("texture", "field"),
    ".obj": ("field",),
    ".glb": ("field",),
    ".gltf": ("field",),
    ".msh": ("texture", "colors"),
    ".mesh": ("texture", "colors", "field"),
    ".meshb": ("texture", "colors", "field"),
    ".ply": ("field is seen", "field vector"),
}
KEPT = "only a file of the same format keeps"  # which says nothing about where points are
MOVING = ("instanc", "skin", "joint", "morph", "precision", "rounded", "coordinate", "moved")
KEPT_AT_CORNERS = ("texture", "colors")
WORDS = {"texture": ("texture",), "colors": ("colors",)}  # which a warning about an aspect says
# Colors of glTF are linear light by the format; these convert them, others store and show them as they are.
LINEAR = ("blender", "three")
# Where no other program reads a file, the bytes of the file are the witness.
NOT_WRITTEN = "theirs: fields of faces, which the header of the file does not have"
EXPLAINED = {
    ("meshio", "PLY", "fields"): NOT_WRITTEN,
    ("meshio", "PLY, text", "fields"): NOT_WRITTEN,
}
WAYS = {"read": "read here", "write": "written here", "again": "read and written here"}
PATIENCE = (
    30.0  # seconds without an answer, of which each takes milliseconds; Blender begins in 5 s
)
Found = dict[str, Any]


class Exchange:
    """The files of one run, and what each program found in each."""

    def __init__(self, folder: Path, environments: Path, tools: list[str]) -> None:
        """Ask each program for its version and what it can do."""
        self.folder, self.environments = folder, environments
        self.shapes = make_shapes()
        self.about: dict[str, Found] = {}
        for tool in tools:
            answers = self.ask(tool, [])
            if answers:
                self.about[tool] = answers[0]
        self.found: dict[tuple[Path, str], Found] = {}  # by file and program
        self.compared: dict[Path, dict[str, Found]] = {}  # by file, then by program
        self.missed: dict[
            Path, set[str]
        ] = {}  # aspects that eigenshape finds to be others, by file

    def command(self, tool: str) -> list[str] | None:
        """Return the command that starts a program; None if it is not installed."""
        package = TOOLS[tool]
        script = FOLDER / f"tool_{tool}.mjs"
        if script.exists():
            modules = self.environments / "npm" / "node_modules"
            if shutil.which("node") is None or not (modules / package).exists():
                return None
            copy = modules.parent / script.name  # node looks for packages beside the script
            copy.write_text(script.read_text(encoding="utf-8"), encoding="utf-8")
            shared = FOLDER / "exchange.mjs"
            copy.with_name(shared.name).write_text(
                shared.read_text(encoding="utf-8"), encoding="utf-8"
            )
            return ["node", str(copy)]
        python = self.environments / tool / "bin" / "python"
        if not python.exists():
            if importlib.util.find_spec(package) is None:
                return None
            python = Path(sys.executable)
        return [str(python), str(script.with_suffix(".py"))]

    def ask(self, tool: str, jobs: list[Found]) -> list[Found]:
        """Let a program do jobs; one at which it crashes is answered by an error, and the rest is begun anew."""
        command = self.command(tool)
        if command is None:
            return []
        asked, answered = self.folder / f"{tool}.jobs", self.folder / f"{tool}.answers"
        answers: list[Found] = []
        while True:
            left = jobs[max(len(answers) - 1, 0) :]
            asked.write_text("".join(json.dumps(job) + "\n" for job in left), encoding="utf-8")
            answered.write_text("", encoding="utf-8")
            end = self.wait_for(tool, [*command, str(asked), str(answered)], answered)
            lines = [json.loads(line) for line in answered.read_text(encoding="utf-8").splitlines()]
            answers += lines[1:] if answers else lines
            n_answered = len(answers) - 1
            if n_answered >= len(jobs) or n_answered < 0:
                return answers
            answers.append({"key": jobs[n_answered]["key"], "error": end})

    def wait_for(self, tool: str, command: list[str], answered: Path) -> str:
        """Wait for the end of a program, or end one that gives no answer, and say how it ended."""
        with (
            (self.folder / f"{tool}.log").open("a") as log,
            subprocess.Popen(command, stdout=log, stderr=log, cwd=self.folder) as process,
        ):
            size = -1
            while True:
                try:
                    return f"the program ended with status {process.wait(PATIENCE)}"
                except subprocess.TimeoutExpired:
                    before, size = size, answered.stat().st_size
                    if size == before:
                        process.kill()
                        return f"the program gave no answer for {PATIENCE:g} s"

    def place(self, folder: str, suffix: str) -> Path:
        """Return the path of a file in its folder, since buffers, materials and images lie beside it."""
        (self.folder / folder).mkdir(exist_ok=True)
        return self.folder / folder / f"shape{suffix}"

    def let_write(self) -> dict[Path, tuple[str, str, str]]:
        """Let all programs write; return the program, the format and the shape of each file, or its error."""
        files = {}
        for tool, about in self.about.items():
            jobs = []
            for number, (form, (suffix, *names)) in enumerate(about["writes"].items()):
                for name in names:
                    path = self.place(f"{tool}-{number}-{name}", suffix)
                    files[path] = (tool, form, name)
                    shape = self.shapes[name]
                    jobs.append(
                        {
                            "act": "write",
                            "format": form,
                            "shape": shape,
                            "path": str(path),
                            "key": str(path),
                        }
                    )
            for job, answer in zip(jobs, self.ask(tool, jobs)[1:], strict=True):
                path = Path(job["path"])
                if "error" in answer:
                    print(f"{tool} does not write {path.name}: {answer['error']}", flush=True)
                    del files[path]
        return files

    def let_read(self, files: list[Path]) -> None:
        """Let every program read all files whose suffix it knows."""
        for tool, about in self.about.items():
            known = [path for path in files if path.suffix in about["reads"] and path.exists()]
            jobs = [{"act": "read", "path": str(path), "key": str(path)} for path in known]
            for path, answer in zip(known, self.ask(tool, jobs)[1:], strict=True):
                self.found[path, tool] = answer

    def differences(self, path: Path, name: str, found: Found) -> Found:
        """Return in which aspects a reading differs from the shape, if the format can hold them."""
        truth = self.shapes[name].get("truth", self.shapes[name])
        cannot = CANNOT.get(path.suffix, ("\0",))
        return {
            aspect: fact
            for aspect, fact in compare(truth, found).items()
            if not aspect.startswith(cannot)
        }

    def readers(self, path: Path, name: str) -> dict[str, Found]:
        """Return the differences that each program finds in a file, of those that can read it."""
        if path not in self.compared:
            self.compared[path] = {
                tool: self.differences(path, name, self.found[path, tool]["found"])
                for tool in self.about
                if "found" in self.found.get((path, tool), {})
            }
        return dict(self.compared[path])


class Written(NamedTuple):
    """A file that eigenshape wrote, or why it did not."""

    path: Path
    name: str  # of the shape
    messages: list[str]
    error: str


def is_named(aspect: str, messages: list[str]) -> str:
    """Return the message that names an aspect, if there is one."""
    if aspect.startswith("field"):
        words = ("fields", repr(aspect.removeprefix("field ")))
    elif aspect in WORDS:
        words = WORDS[aspect]
    else:
        words = MOVING
        messages = [text for text in messages if KEPT not in text]
    return next((text for text in messages if any(word in text.lower() for word in words)), "")


def first_words(text: str) -> str:
    """Return the beginning of a message without the path before it."""
    text = text.split(": ", 1)[-1] if "/" in text.split(": ", maxsplit=1)[0] else text
    sentence = text.replace("|", "/").split("; ")[0].split(". ")[0]
    return sentence if len(sentence) <= 90 else sentence[:87] + "..."


def judge_reading(exchange: Exchange, path: Path, tool: str, name: str) -> str:
    """Judge what eigenshape reads of the file of a program."""
    found, messages, error = listen(lambda: read_here(path))
    exchange.missed[path] = set()
    if error:
        return f"named: {first_words(error)}"
    results = []
    witnesses = exchange.readers(path, name)
    differences = exchange.differences(path, name, found)
    exchange.missed[path] = set(differences)
    for aspect, fact in differences.items():
        if message := is_named(aspect, messages):
            results.append(f"named: {first_words(message)}")
            continue
        right = finders(aspect, witnesses)
        alike = [
            other
            for other in witnesses
            if agrees(found, exchange.found[path, other]["found"], aspect)
        ]
        # A program may read its own numbers by a convention that is not the format's.
        has_own_convention = right == [tool] and aspect in KEPT_AT_CORNERS and fact != "none"
        is_light = aspect == "colors" and path.suffix in (".glb", ".gltf")
        takes_light = is_light and any(other in LINEAR for other in alike)
        if alike and (not right or has_own_convention or takes_light):
            results.append(f"theirs: {aspect} {fact}, and so read {listed(alike)}")
        else:
            results.append(f"SILENT: {aspect} {fact}; right in {listed(right) or 'no program'}")
    return worst(results)


def finders(aspect: str, witnesses: dict[str, Found]) -> list[str]:
    """Return the programs that find an aspect as it should be, where the points are right, too."""
    return [
        tool
        for tool, differences in witnesses.items()
        if aspect not in differences and "coordinates" not in differences
    ]


def listed(tools: list[str]) -> str:
    """Return the names of at most three programs, and how many there are besides."""
    names = [TITLES[tool] for tool in tools]
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def agrees(ours: Found, theirs: Found, aspect: str) -> bool:
    """Return whether another program reads the same as eigenshape."""
    stored = f"corner_{aspect}"
    if aspect not in KEPT_AT_CORNERS:
        return aspect not in compare(ours, theirs)
    if stored not in ours:
        return aspect not in theirs and stored not in theirs
    # The values of corners are those of points, if each corner is a point.
    corners = [corner for face in ours["polygons"] for corner in face]
    split = {
        "points": [ours["points"][corner] for corner in corners],
        "polygons": [[i, i + 1, i + 2] for i in range(0, len(corners), 3)],
        aspect: [row for face in ours[stored] for row in face],
    }
    return aspect not in compare(split, theirs)


def judge_writing(
    exchange: Exchange, written: Written, tool: str, unknown: Set[str] = frozenset()
) -> str:
    """Judge what a program reads of a file of eigenshape, but for aspects that are unknown before."""
    path, name, messages, error = written
    if error:
        return f"named: {first_words(error)}"
    answer = exchange.found[path, tool]
    others = exchange.readers(path, name)
    others.pop(tool, None)
    if "error" in answer:
        reads = any("coordinates" not in differences for differences in others.values())
        kind = "theirs" if reads else "SILENT"
        return f"{kind}: {first_words(answer['error'])}"
    results = []
    for aspect, fact in exchange.differences(path, name, answer["found"]).items():
        if aspect in unknown:
            continue
        right = finders(aspect, others)
        if message := is_named(aspect, messages):
            results.append(f"named: {first_words(message)}")
        elif right:
            results.append(f"theirs: {aspect} {fact}, and right in {listed(right)}")
        else:
            results.append(f"SILENT: {aspect} {fact}")
    return worst(results)


def worst(results: list[str]) -> str:
    """Return the results of the aspects as one."""
    for kind in ("SILENT", "named", "theirs"):
        chosen = [result.removeprefix(f"{kind}: ") for result in results if result.startswith(kind)]
        if chosen:
            return f"{kind}: {'; '.join(dict.fromkeys(chosen))}"
    return "equal"


def write_ours(exchange: Exchange) -> list[Written]:
    """Write our shapes in our formats."""
    written = []
    for suffix, names in OURS.items():
        for name in names:
            path = exchange.place(f"here-{name}-{suffix[1:]}", suffix)
            _, messages, error = listen(partial(write_here, exchange.shapes[name], path))
            written.append(Written(path, name, messages, error))
    return written


def write_theirs_again(
    exchange: Exchange, theirs: dict[Path, tuple[str, str, str]]
) -> dict[Path, Written]:
    """Write again, by the file that each was read from, what programs wrote in formats with attributes."""
    written = {}
    for source, (_, _, name) in theirs.items():
        suffix = AGAIN.get(source.suffix)
        if suffix and "triangles" in exchange.shapes[name]:
            path = exchange.place(f"{source.parent.name}-again", suffix)
            _, messages, error = listen(partial(write_again, source, path))
            written[source] = Written(path, name, messages, error)
    return written


def run(exchange: Exchange) -> list[dict[str, str]]:
    """Let programs write and read, and judge all of it; a row for each file and way."""
    theirs = exchange.let_write()
    ours = write_ours(exchange)
    again = write_theirs_again(exchange, theirs)
    exchange.let_read([*theirs, *(each.path for each in [*ours, *again.values()])])
    rows = []

    def add(tool: str, form: str, way: str, name: str, result: str) -> None:
        version = exchange.about[tool]["version"]
        row = {"tool": tool, "version": version, "format": form, "way": way}
        rows.append(row | {"shape": name, "result": result})
        if "SILENT" in result:
            print(*rows[-1].values(), sep="  ", flush=True)

    for path, (tool, form, name) in theirs.items():
        result = judge_reading(exchange, path, tool, name)
        if "right in no program" in result:
            result = EXPLAINED.get((tool, form, name), result)
        add(tool, form, "read", name, result)
    for each in ours:
        for tool, about in exchange.about.items():
            if each.path.suffix in about["reads"]:
                form = each.path.suffix[1:].upper()
                add(tool, form, "write", each.name, judge_writing(exchange, each, tool))
    for source, each in again.items():
        tool, form, name = theirs[source]
        if each.path.suffix in exchange.about[tool]["reads"]:
            # What the program does not find in its own file, or eigenshape in it, is judged by then.
            unknown = set(exchange.readers(source, name).get(tool, {})) | exchange.missed[source]
            add(tool, form, "again", name, judge_writing(exchange, each, tool, unknown))
    return rows


def table(rows: list[dict[str, str]]) -> list[list[str]]:
    """Return a row for each program and way, and for formats with the same results; shapes stand in the cells."""
    groups: dict[tuple[str, str, str], dict[str, list[str]]] = {}
    for row in rows:
        key = (row["tool"], row["way"], row["format"])
        kind, _, text = row["result"].partition(": ")
        # A reader of the page asks what differs and for whom; by how much stands in the file of figures.
        short = (
            re.sub(r" (?:off by|\S+ for) .*?(?=, and |$)", "", text) if kind == "theirs" else text
        )
        cell = row["shape"] if kind == "equal" else f"*{row['shape']}*: {short}"
        groups.setdefault(key, {}).setdefault(kind, []).append(cell)
    versions = {row["tool"]: row["version"] for row in rows}
    merged: dict[tuple[str, str, str], list[str]] = {}
    for (tool, way, form), kinds in groups.items():
        cells = json.dumps(kinds, sort_keys=True)
        merged.setdefault((tool, way, cells), []).append(form)
    lines = []
    for (tool, way, cells), forms in merged.items():
        kinds = json.loads(cells)
        others = [
            f"{text} ({kind})"
            for kind in ("named", "theirs", "SILENT")
            for text in kinds.get(kind, [])
        ]
        lines.append(
            [
                f"{TITLES[tool]} {versions[tool]}",
                "; ".join(forms),
                WAYS[way],
                ", ".join(kinds.get("equal", [])),
                "<br>".join(others).replace("|", "/"),
            ]
        )
    return lines


def main() -> None:
    """Do what the options ask for."""
    parser = options_of(__doc__)
    parser.add_argument("--tools", default=",".join(TOOLS), help="programs, separated by commas")
    parser.add_argument(
        "--environments",
        type=Path,
        default=Path(
            os.environ.get("EIGENSHAPE_INTEROP", Path.home() / ".cache/eigenshape-interop")
        ),
        help="folder of Pythons and node_modules of programs; EIGENSHAPE_INTEROP names another default",
    )
    parser.add_argument("--keep", type=Path, help="folder for the files")
    options = parser.parse_args()
    tools = ["meshio"] if options.quick else options.tools.split(",")
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).resolve()
        folder.mkdir(exist_ok=True, parents=True)
        exchange = Exchange(folder, options.environments.expanduser(), tools)
        for tool in tools:
            if tool not in exchange.about:
                print(f"{tool}: not installed", flush=True)
        rows = run(exchange)
    columns = ["program", "format", "way", "equal", "other"]
    figures = new_figures(["eigenshape", "numpy"], columns, "one thread", repeats=1)
    figures["table"], figures["rows"] = table(rows), rows
    if options.json:
        dump(options.json, figures)
    counts = {
        kind: sum(row["result"].startswith(kind) for row in rows)
        for kind in ("equal", "named", "theirs", "SILENT")
    }
    print(f"{len(rows)} results:", ", ".join(f"{count} {kind}" for kind, count in counts.items()))
    if counts["SILENT"]:
        sys.exit(f"{counts['SILENT']} differences are silent.")


if __name__ == "__main__":
    main()
