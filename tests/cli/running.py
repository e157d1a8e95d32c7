"""Run the command in this process, as most tests of verbs do: a process of its own takes a second."""

import json

from typer.testing import CliRunner

from eigenshape.cli import app


def run(*arguments, code=0):
    """Run the command; its exit code must be this one. Return what it printed."""
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == code, done.output + done.stderr
    return done


def run_json(*arguments, code=0):
    """Return what the command prints with --json."""
    return json.loads(run(*arguments, "--json", code=code).stdout)
