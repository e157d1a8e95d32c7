"""The command line."""

from typing import Annotated

import typer

import eigenshape
from eigenshape.cli.verbs import MARKUP, Verbs

app = typer.Typer(
    cls=Verbs,
    rich_markup_mode=MARKUP,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 an error named on stderr, 2 wrong usage, 3 some of several inputs failed, "
    "130 stopped by Ctrl-C.",
)


def _print_version(wanted: bool) -> bool:
    if wanted:
        typer.echo(f"eigenshape {eigenshape.__version__}")
        raise typer.Exit
    return wanted


@app.callback()
def options(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and exit.", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Spectral shape analysis: certified spectra, features and parts, similar shapes, bending."""
