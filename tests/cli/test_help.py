"""What `--help` and `--version` print."""

import re
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import get_args

import pytest
import typer
from typer.testing import CliRunner

import eigenshape
from eigenshape.cli import app
from eigenshape.cli.inputs import HeatMethod
from eigenshape.cli.spectrum import USUAL
from eigenshape.cli.steps.recipes import PRESETS
from eigenshape.cli.verbs import INDEX_VERBS, TOGETHER, VERBS, load_verb
from eigenshape.features.contrast import PART_CONTRAST
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS
from eigenshape.io.formats.registry import WRITTEN
from eigenshape.stability.plan import USUAL_K

COMMAND = typer.main.get_command(app)
# eigenshape itself and the command line are light; these take a second together
HEAVY = {"numpy", "scipy", "matplotlib", "sqlite3", "jaxtyping"}
NAMES = [*VERBS, *(f"index {verb}" for verb in INDEX_VERBS)]
WIDE = {"COLUMNS": "2000"}  # no text is broken over lines


def words(text):
    """Return text as one line, without the frames around it and without backticks."""
    return " ".join(re.sub("[│─╭╮╰╯]", " ", text).replace("`", "").split())


@cache
def printed(*arguments):
    done = CliRunner().invoke(app, [*arguments, "--help"], env=WIDE)
    assert done.exit_code == 0
    return words(done.stdout)


@pytest.mark.parametrize("verb", ["", *NAMES])
def test_help_is_printed_to_the_letter(verb):
    """Nothing in it is taken for markup, such as the brackets of `eigenshape[bridges]`."""
    command = load_verb(verb) if verb else COMMAND
    text = printed(*verb.split())
    written = [command.help, *(parameter.help for parameter in command.params)]
    if not verb:
        written += [COMMAND.epilog, *VERBS]
    for sentence in filter(None, written):
        assert words(sentence) in text


@pytest.mark.parametrize("verb", NAMES)
def test_lists_have_the_first_line_of_each_verb(verb):
    """They read it from the files, without importing them."""
    group = verb.split()[:-1]
    assert words(load_verb(verb).help.split("\n\n")[0]) in printed(*group)


def test_every_module_with_a_verb_is_in_the_list():
    """A module with a verb has the function of its name, `index` that of each of its verbs."""
    folder = Path(eigenshape.cli.__file__).parent
    names = {
        path.stem.replace("_", "-")
        for path in folder.glob("*.py")
        if f"\ndef {path.stem}(" in path.read_text()
    }
    assert names | {*TOGETHER} | {"index"} == {*VERBS}
    assert {*TOGETHER.values()} <= names
    functions = re.findall(r"^def ([a-z]\w*)\(", (folder / "index.py").read_text(), re.MULTILINE)
    assert functions == [*INDEX_VERBS]


def test_help_loads_nothing_heavy():
    """One process takes them all, because nothing that one loads may be heavy."""
    calls = [
        ["--help"],
        [],
        ["--version"],
        ["quary"],
        *([*verb.split(), "--help"] for verb in NAMES),
    ]
    code = (
        "import sys, eigenshape_command\n"
        f"for arguments in {calls}:\n"
        "    sys.argv[1:] = arguments\n"
        "    try: eigenshape_command.main()\n"
        f"    except SystemExit: print(arguments, sorted({HEAVY} & sys.modules.keys()), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = [line for line in done.stderr.splitlines() if line.startswith("[")]
    assert lines == [f"{arguments} []" for arguments in calls]


def test_a_misspelt_verb_gets_a_suggestion():
    done = CliRunner().invoke(app, ["quary"])
    assert done.exit_code == 2
    assert "Did you mean 'query'?" in done.stderr


@pytest.mark.parametrize("verb", NAMES)
def test_every_option_is_explained_in_a_sentence(verb):
    for parameter in load_verb(verb).params:
        if parameter.name != "help":
            assert parameter.help, parameter.name
            assert parameter.help[-1] == ".", parameter.name


def test_the_version():
    assert eigenshape.__version__ == version("eigenshape")
    assert CliRunner().invoke(app, ["--version"]).stdout == f"eigenshape {version('eigenshape')}\n"


@pytest.mark.parametrize("module", ["eigenshape", "eigenshape_command"])
def test_the_command_is_a_module_too(module):
    command = [sys.executable, "-m", module, "info", "--color"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Usage: eigenshape info" in done.stderr
    assert "No such option" in done.stderr


ALL = [(verb, parameter) for verb in NAMES for parameter in load_verb(verb).params]


def spellings(of):
    return {tuple(parameter.opts) for _, parameter in ALL if of(parameter)}


def test_the_main_output_of_every_verb_is_called_output():
    assert spellings(lambda parameter: parameter.name == "output") == {("-o", "--output")}
    assert spellings(lambda parameter: "-o" in parameter.opts) == {("-o", "--output")}
    texts = {verb: parameter.help for verb, parameter in ALL if parameter.name == "output"}
    assert len(texts) > 10
    for verb, text in texts.items():
        assert text.startswith("Write "), verb


def test_a_number_of_things_is_called_n():
    for verb, parameter in ALL:
        assert ("-n" in parameter.opts) == parameter.name.startswith("n_"), verb


def test_what_help_says_of_the_library_is_so():
    """Docstrings hold no values, so they are compared with them here."""
    texts = {(verb, parameter.name): parameter.help for verb, parameter in ALL}
    assert get_args(HeatMethod) == (*PRESETS,)
    assert f"By default {USUAL}," in texts["spectrum", "k"]
    assert f"By default {USUAL_K}," in texts["stability", "k"]
    assert f"is {PART_CONTRAST} by default" in texts["segment", "persistence"]
    assert f": {', '.join(MESH_REPAIRS)}. none only" in texts["repair", "repair"]
    for verb in ("repair", "decimate", "deform", "pose", "fuse", "decompress"):
        assert ", ".join(WRITTEN) in texts[verb, "output"]


def test_a_picture_is_called_picture():
    drawn = {
        parameter.name for _, parameter in ALL if "PNG, SVG or PDF" in " ".join([parameter.help])
    }
    assert drawn == {"picture", "eigenfunctions", "explain"}
    assert spellings(lambda parameter: parameter.name == "picture") == {("--picture",)}


def test_an_index_is_the_first_argument():
    for verb in ("index add", "index ls", "index rm", "index stats", "index verify", "query"):
        first = load_verb(verb).params[0]
        assert (first.name, first.param_type_name) == ("index", "argument")


def test_an_option_of_one_name_is_spelled_alike_in_every_verb():
    options = [found for _, found in ALL if found.param_type_name == "option"]
    for name in {option.name for option in options}:
        assert len({tuple(option.opts) for option in options if option.name == name}) == 1, name


def test_no_option_has_two_long_names():
    for verb, parameter in ALL:
        long = [text for text in parameter.opts if text.startswith("--")]
        assert len(long) <= 1, (verb, parameter.opts)


@pytest.mark.parametrize("verb", ["", "info", "index ls"])
def test_flags_take_no_value(verb):
    assert "<bool>" not in printed(*verb.split())
