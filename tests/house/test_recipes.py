"""The recipes of CONTRIBUTING.md, followed."""

import inspect
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from laws.test_every_operator import judge, rows_of_registry
from laws.test_unit_laws import Shapes, law_of_operator, numbers
from registered_operators import builders, of_surfaces
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app
from eigenshape.cli.verbs import INDEX_VERBS, VERBS, load_verb

ROOT = Path(__file__).resolve().parents[2]
RECIPES = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("\n## Recipes\n")[1]
RECIPES = RECIPES.split("\n## ")[0]
KINDS = {
    es.TriangleMesh: "triangles",
    es.SimplicialMesh: "simplices",
    es.PointCloud: "points",
    sp.sparray: "graphs",
}


def test_every_file_that_a_recipe_names_is_there():
    paths = {path for path in re.findall(r"`([\w/.]+)`", RECIPES) if "/" in path}
    assert paths
    assert not [path for path in paths if not (ROOT / path).exists()]


# An operator.


def named_rows() -> list[str]:
    """Return the table of operators by name, as docs/operators.md shows it."""
    return [
        f"| `{name}` | {', '.join(KINDS[kind] for kind in entry.shapes)} | "
        f"{', '.join(f'`{option}`' for option in entry.options) or 'none'} | {entry.description} |"
        for name, entry in es.operators.OPERATORS.items()
    ]


def missing_rows() -> list[str]:
    """Return the rows that docs/operators.md lacks."""
    lines = (ROOT / "docs" / "operators.md").read_text(encoding="utf-8").splitlines()
    return [row for row in named_rows() if row not in lines]


def test_the_docs_name_every_operator():
    assert not missing_rows()


def halved_laplacian(mesh: es.TriangleMesh, *, share: float = 0.5) -> es.Laplacian:
    """Return a share of the energy of linear elements."""
    laplacian = es.cotangent_laplacian(mesh, "consistent")
    return es.Laplacian(share * laplacian.stiffness, laplacian.mass)


@pytest.fixture
def halved(monkeypatch):
    entry = es.operators.Operator(halved_laplacian, (es.TriangleMesh,), "half of the energy")
    monkeypatch.setitem(es.operators.OPERATORS, "halved", entry)
    return entry


def test_an_operator_is_there_by_its_entry(halved, tmp_path):
    ball = es.icosphere(2)
    built = es.build_laplacian(ball, "halved", share=0.25)
    difference = 4 * built.stiffness - es.cotangent_laplacian(ball).stiffness
    assert abs(difference).max() == 0
    with pytest.raises(es.InvalidParameterError, match="normalized, halved; it is 'none'"):
        es.build_laplacian(ball, "none")
    listed = CliRunner().invoke(app, ["operators"]).stdout
    assert "half of the energy" in listed
    assert "share" in listed
    es.write_mesh(ball, tmp_path / "ball.off")
    done = CliRunner().invoke(
        app, ["spectrum", str(tmp_path / "ball.off"), "-k", "4", "--operator", "halved"]
    )
    assert done.exit_code == 0, done.output


def test_an_operator_is_tested_by_its_entry(halved):
    assert builders()["halved_laplacian"] is halved
    assert of_surfaces()["halved"] is halved_laplacian
    (row,) = [row for row in rows_of_registry([]) if row.name == "halved"]
    judge(row.build, row.shapes[0], row.promises, seed=1)
    power, call = law_of_operator(halved)
    one, other = (numbers(call(Shapes(u))) for u in (1.0, 4.0))
    np.testing.assert_allclose(other / 4.0**power, one, rtol=1e-9)


def test_an_operator_is_documented_by_its_entry(halved):
    assert "| `halved` | triangles | `share` | half of the energy |" in missing_rows()


# A default.

# Options with a number or name that the library has as the default of an argument or a field.
DEFAULTS = {
    "collection timeout": (es.retrieval.Workers, "timeout"),
    "collection unit": (es.morphometrics.read_specimens, "unit"),
    "compress bits": (es.spectral.compress_mesh, "bits"),
    "condense timeout": (es.retrieval.Workers, "timeout"),
    "condense tolerance": (es.features.condense, "tolerance"),
    "deform mode": (es.deform, "mode"),
    "features n_parts": (es.retrieval.HeatRecipe, "n_features"),
    "index add timeout": (es.retrieval.Workers, "timeout"),
    "index duplicates score": (es.retrieval.find_duplicates, "most_score"),
    "index learn timeout": (es.retrieval.Workers, "timeout"),
    "match overlap": (es.match_shapes, "overlap"),
    "match scale": (es.match_shapes, "scale"),
    "query n_matches": (es.ShapeIndex.query, "n_matches"),
    "stability n_samples": (es.stability.StabilityPlan, "n_samples"),
}
# Of every verb that reads a shape or draws one, and of the functions that do.
EVERYWHERE = {
    "dim": (es.read_shape, "dim"),
    "view": (es.figure_field, "view"),
    "up": (es.figure_field, "up"),
}
# Functions that share a default of one argument.
SHARED = {
    "mode": (es.deform, es.deformation.bend, es.DeformationSession),
    "n_matches": (es.ShapeIndex.query, es.retrieval.IndexReader.query, es.retrieval.query_indexes),
}
# Options that no function has: what a verb is given in words, and what belongs to a server.
OF_THE_COMMAND_LINE = {
    "demo kind",
    "demo output",
    "condense n_modes",
    "features method",
    "index add method",
    "report n_modes",
    "segment method",
    "serve host",
    "serve port",
    "serve timeout",
    "serve workers",
    "spectrum boundary",
    "stability normalize",
    "studio host",
}
VERB_NAMES = [
    *(verb for verb in VERBS if verb != "index"),
    *(f"index {verb}" for verb in INDEX_VERBS),
]


@pytest.mark.parametrize("verb", VERB_NAMES)
def test_a_default_of_a_verb_is_that_of_the_library(verb):
    for option in load_verb(verb).params:
        if option.default in (None, False, True, "", (), []) or option.name == "repair":
            continue  # what is not given is left to the library; repairs of a verb have a name
        name = f"{verb} {option.name}"
        if name not in OF_THE_COMMAND_LINE:
            place = DEFAULTS.get(name) or EVERYWHERE.get(option.name)
            assert place, f"{name} has a default: name it in DEFAULTS or OF_THE_COMMAND_LINE."
            function, argument = place
            default = inspect.signature(function).parameters[argument].default
            assert option.default == default, f"{name}; {function.__name__} has {default}"


@pytest.mark.parametrize("argument", SHARED)
def test_functions_that_share_an_argument_share_its_default(argument):
    defaults = {
        function.__qualname__: inspect.signature(function).parameters[argument].default
        for function in SHARED[argument]
    }
    assert len(set(defaults.values())) == 1, defaults
