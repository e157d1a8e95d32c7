"""What `--help` and `--version` print."""

import re
import subprocess
import sys
from importlib.metadata import version

import pytest
import typer
from typer.testing import CliRunner

import eigenshape
from eigenshape.cli import app

COMMAND = typer.main.get_command(app)
VERBS = sorted(COMMAND.commands)
WIDE = {"COLUMNS": "2000"}  # no text is broken over lines


def words(text):
    """Return text as one line, without the frames around it and without backticks."""
    return " ".join(re.sub("[│─╭╮╰╯]", " ", text).replace("`", "").split())


def printed(*arguments):
    done = CliRunner().invoke(app, [*arguments, "--help"], env=WIDE)
    assert done.exit_code == 0
    return words(done.stdout)


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_help_is_printed_to_the_letter(verb):
    """Nothing in it is taken for markup, such as the brackets of `eigenshape[bridges]`."""
    command = COMMAND.commands[verb] if verb else COMMAND
    text = printed(verb) if verb else printed()
    written = [command.help, *(parameter.help for parameter in command.params)]
    if not verb:
        written += [
            COMMAND.epilog,
            *(other.help.split("\n\n")[0] for other in COMMAND.commands.values()),
        ]
    for sentence in filter(None, written):
        assert words(sentence) in text


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_is_explained_in_a_sentence(verb):
    for parameter in COMMAND.commands[verb].params:
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
    assert done.stderr == "error: [Errno 2] No such file or directory: 'nowhere.ply'\n"
    usage = subprocess.run(
        [sys.executable, "-m", module, "info", "-h"], capture_output=True, text=True, check=True
    )
    assert "Usage: eigenshape info" in usage.stdout
