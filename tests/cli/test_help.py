"""What `--help` and `--version` print."""

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import eigenshape
from eigenshape.cli import app
from eigenshape.cli.verbs import INDEX_VERBS, VERBS, load_verb

COMMAND = typer.main.get_command(app)
# eigenshape itself and the command line are light; these take a second together
HEAVY = {"numpy", "numba", "scipy", "matplotlib", "sqlite3", "jaxtyping"}
LINES = VERBS | {f"index {verb}": line for verb, line in INDEX_VERBS.items()}
WIDE = {"COLUMNS": "2000"}  # no text is broken over lines


def words(text):
    """Return text as one line, without the frames around it and without backticks."""
    return " ".join(re.sub("[│─╭╮╰╯]", " ", text).replace("`", "").split())


def printed(*arguments):
    done = CliRunner().invoke(app, [*arguments, "--help"], env=WIDE)
    assert done.exit_code == 0
    return words(done.stdout)


@pytest.mark.parametrize("verb", ["", *LINES])
def test_help_is_printed_to_the_letter(verb):
    """Nothing in it is taken for markup, such as the brackets of `eigenshape[bridges]`."""
    command = load_verb(verb) if verb else COMMAND
    text = printed(*verb.split())
    written = [command.help, *(parameter.help for parameter in command.params)]
    if not verb:
        written += [COMMAND.epilog, *VERBS, *VERBS.values()]
    for sentence in filter(None, written):
        assert words(sentence) in text


@pytest.mark.parametrize("verb", LINES)
def test_the_list_of_verbs_has_the_first_line_of_each_docstring(verb):
    assert words(load_verb(verb).help.split("\n\n")[0]) == words(LINES[verb])


def test_every_module_with_a_verb_is_in_the_list():
    folder = Path(eigenshape.cli.__file__).parent
    assert verbs_in(folder) == VERBS.keys() - {"index"}
    assert verbs_in(folder / "index") == INDEX_VERBS.keys()


def verbs_in(folder):
    return {
        path.stem.replace("_", "-")
        for path in folder.glob("*.py")
        if f"\ndef {path.stem}(" in path.read_text()
    }


@pytest.mark.parametrize(
    "arguments",
    [["--help"], [], ["--version"], ["quary"], *([*verb.split(), "--help"] for verb in LINES)],
)
def test_help_loads_nothing_heavy(arguments):
    code = (
        "import sys, eigenshape_command\n"
        "try: eigenshape_command.main()\n"
        f"finally: print(sorted({HEAVY} & sys.modules.keys()), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False
    )
    assert done.stderr.endswith("[]\n")


def test_a_misspelt_verb_gets_a_suggestion():
    done = CliRunner().invoke(app, ["quary"])
    assert done.exit_code == 2
    assert "Did you mean 'query'?" in done.stderr


@pytest.mark.parametrize("verb", LINES)
def test_every_option_is_explained_in_a_sentence(verb):
    for parameter in load_verb(verb).params:
        if parameter.name != "help":
            assert parameter.help, parameter.name
            assert parameter.help[-1] == ".", parameter.name


def test_the_version():
    assert eigenshape.__version__ == version("eigenshape")
    assert CliRunner().invoke(app, ["--version"]).stdout == f"eigenshape {version('eigenshape')}\n"


@pytest.mark.long
@pytest.mark.parametrize("module", ["eigenshape", "eigenshape_command"])
def test_the_command_is_a_module_too(module):
    done = subprocess.run(
        [sys.executable, "-m", module, "info", "nowhere.ply"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr == "error: nowhere.ply: No such file or directory\n"
    usage = subprocess.run(
        [sys.executable, "-m", module, "info", "-h"], capture_output=True, text=True, check=True
    )
    assert "Usage: eigenshape info" in usage.stdout


ALL = [(verb, parameter) for verb in LINES for parameter in load_verb(verb).params]


def spellings(of):
    return {tuple(parameter.opts) for _, parameter in ALL if of(parameter)}


def test_the_main_output_of_every_verb_is_called_output():
    written = [verb for verb, parameter in ALL if parameter.name == "output"]
    assert written == [
        "repair",
        "decimate",
        "spectrum",
        "features",
        "segment",
        "label",
        "match",
        "deform",
        "pose",
        "query",
        "fuse",
        "compress",
        "decompress",
        "report",
        "demo",
        "index export",
        "index learn",
    ]
    assert spellings(lambda parameter: parameter.name == "output") == {("-o", "--output")}
    assert spellings(lambda parameter: "-o" in parameter.opts) == {("-o", "--output")}


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
    for name in {parameter.name for _, parameter in ALL}:
        options = [found for _, found in ALL if found.name == name]
        if name not in {"shape", "mesh"}:  # which are arguments
            assert len({tuple(option.opts) for option in options}) == 1, name


def test_no_option_has_two_long_names():
    for verb, parameter in ALL:
        long = [text for text in parameter.opts if text.startswith("--")]
        assert len(long) <= 1, (verb, parameter.opts)


@pytest.mark.parametrize("verb", ["", "info", "index ls"])
def test_flags_take_no_value(verb):
    assert "<bool>" not in printed(*verb.split())
