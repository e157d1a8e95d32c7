"""The recipe "Add a mesh format" of CONTRIBUTING.md, followed; and the lists of formats, which are one."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import eigenshape
from eigenshape.io.formats.registry import FORMATS

ROOT = Path(__file__).parents[2]
PACKAGE = Path(eigenshape.__file__).parent
# Everything that a stranger does with a file of the new format
SCRIPT = r"""
import eigenshape as es
from eigenshape.cli import app
from typer.testing import CliRunner

def run(*arguments):
    done = CliRunner().invoke(app, arguments)
    return done.exit_code, " ".join(done.output.split())

mesh = es.read_mesh("a.tri")
assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 0.1, 0], [0, 0, 1]]
es.write_mesh(mesh, "b.tri")
es.write_mesh(mesh, "c.ply")
assert (es.read_mesh("b.tri").faces == mesh.faces).all()
assert es.read_shape("a.tri").n_faces == es.io.read_surface("a.tri").mesh.n_faces == 4
assert [item.name for item in es.io.find_items(".")] == ["a", "b", "c", "cut"]
assert ".tri" in es.io.MESH_FORMATS and ".tri" in es.io.SHAPE_FORMATS
code, text = run("repair", "c.ply", "-o", "d.tri")
assert code == 0 and open("d.tri").read() == open("b.tri").read(), text
assert "4 faces" in run("info", "a.tri")[1]
for verb in ("info", "repair"):
    assert ".tri" in run(verb, "--help")[1], verb
for path, words in {"a.abc": "must be of a known format", "cut.tri": "must hold what it declares"}.items():
    code, text = run("info", path)
    assert code != 0 and words in text and ".tri" in text, text
for write in (lambda: es.write_mesh(mesh, "a.abc"), lambda: es.write_mesh(mesh, "e.tri", binary=True)):
    try:
        write()
    except es.EigenshapeError as error:
        assert ".tri" in str(error), error
    else:
        raise AssertionError(write)
"""
TRIANGLES = "4 4\n0 0 0\n1 0 0\n0 0.1 0\n0 0 1\n0 2 1\n0 1 3\n1 2 3\n0 3 2\n"


@pytest.fixture
def followed(tmp_path):
    """A copy of the package, of links to its files, in which the recipe was followed."""
    recipe = (ROOT / "CONTRIBUTING.md").read_text().partition("### Add a mesh format")[2]
    recipe = recipe.partition("\n## ")[0]
    (module,) = re.findall(r"```python\n(.*?)```", recipe, re.DOTALL)
    module = re.sub(r"(?m)^ {3}", "", module)  # code in a list is indented by three
    (entry,) = re.findall(r"`(Format\(.*?\))`", recipe)
    changed = ("eigenshape", "eigenshape/io", "eigenshape/io/formats")
    for folder in changed:
        (tmp_path / folder).mkdir()
        for path in (PACKAGE.parent / folder).iterdir():
            place = tmp_path / folder / path.name
            if f"{folder}/{path.name}" not in changed and path.name != "__pycache__":
                place.symlink_to(path)
    formats = tmp_path / "eigenshape/io/formats"
    registry = (formats / "registry.py").read_text()
    (formats / "registry.py").unlink()
    (formats / "registry.py").write_text(
        registry.replace("FORMATS = (\n", f"FORMATS = (\n    {entry},\n")
    )
    (formats / "tri.py").write_text(module)
    return tmp_path


def test_the_recipe_gives_a_format_that_all_readers_know(followed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("work")
    (folder / "a.tri").write_text(TRIANGLES)
    (folder / "cut.tri").write_text(TRIANGLES[:-3])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**os.environ, "PYTHONPATH": str(followed), "COLUMNS": "4000"},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_the_docs_list_the_formats_with_what_they_can():
    text = (ROOT / "docs" / "files.md").read_text()
    lines = [line for line in text.splitlines() if line.startswith("|")]
    table = [cells for cells in map(cells_of, lines) if cells[0].startswith(".")]
    rows = {cells[0]: cells for cells in table[: len(FORMATS)]}  # a second table follows
    assert list(rows) == [known.suffix for known in FORMATS]
    for known in FORMATS:
        _, _, read, written, besides = rows[known.suffix]
        readers = {
            "`read_mesh`": {"cells"},
            "`read_points`": {"points"},
            "`read_volume`": {"volume"},
            "`read_fields`": {"maps"},
            "`read_parcellation`": {"parcels"},
        }
        names = [name for name, traits in readers.items() if traits & set(known.traits)]
        assert read == (", ".join(names) if known.suffix != ".swc" else "`read_shape`")
        writers = {
            "`write_mesh`": {"text", "binary"},
            "`write_points`": {"cloud"},
            "`write_fields`": {"fields", "maps"},
            "`write_parcellation`": {"parcels"},
        }
        # Maps in most files of NIfTI are only read.
        if known.suffix in {".dtseries.nii", ".dlabel.nii", ".nii", ".nii.gz"}:
            del writers["`write_fields`"]
        names = [name for name, traits in writers.items() if traits & set(known.traits)]
        assert written == ", ".join(names), known.suffix
        assert bool(besides) == bool({"attributes", "fields"} & set(known.traits)), known.suffix
        assert ("fields" in known.traits) <= ("fields" in besides)


def test_the_table_of_what_becomes_of_files_is_that_of_the_readers():
    spec = importlib.util.spec_from_file_location("format_table", ROOT / "docs/format_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.page_with_table() == (ROOT / "docs" / "files.md").read_text()
    assert module.format_table().count("\n") == 2 + len({known.module for known in FORMATS})
    assert module.format_table() in module.page_with_table()


def cells_of(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def test_every_module_of_a_format_has_what_its_traits_promise():
    for known in FORMATS:
        module = known.load()
        if {"cells", "points"} & set(known.traits):
            assert callable(module.parse)
        if "maps" in known.traits:
            assert callable(module.parse_fields)
            assert callable(module.format_maps)
        if "parcels" in known.traits:
            assert callable(module.parse_parcels)
            assert callable(module.format_parcels)
        if "fields" in known.traits:
            assert callable(module.parse_fields)
            assert callable(module.format_fields)
        if beside := known.load_attributes():
            assert callable(beside.read_attributes)
            assert callable(beside.write)
        else:
            for form in {"text", "binary"} & set(known.traits):
                assert callable(getattr(module, f"format_{form}"))
        assert hasattr(module, "format_points") == ("cloud" in known.traits)
