"""The verbs, gathered."""

from typing import Annotated

import typer

import eigenshape
from eigenshape.cli.console import Verbs
from eigenshape.cli.deform import deform
from eigenshape.cli.demo import demo
from eigenshape.cli.features import features
from eigenshape.cli.index import index
from eigenshape.cli.info import info
from eigenshape.cli.label import label
from eigenshape.cli.operators import operators
from eigenshape.cli.query import query
from eigenshape.cli.repair import repair
from eigenshape.cli.segment import segment
from eigenshape.cli.spectrum import spectrum
from eigenshape.cli.stability import stability

app = typer.Typer(
    cls=Verbs,
    rich_markup_mode="markdown",  # plain brackets stay: rich markup would read "eigenshape[bridges]" as a style
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 an error named on stderr, 2 wrong usage, 3 some shapes could not be indexed, "
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
    """Spectral shape analysis: spectra with proof, heat, features and parts, similar shapes, bending."""


for verb in (
    info,
    repair,
    spectrum,
    operators,
    features,
    segment,
    label,
    deform,
    stability,
    index,
    query,
    demo,
):
    app.command(no_args_is_help=verb not in (demo, operators))(verb)
