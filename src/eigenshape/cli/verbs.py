"""The verbs of the command line: a list that costs nothing, and modules loaded when a verb is called."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from eigenshape._errors import EigenshapeError, InvalidParameterError
from eigenshape._text import printable
from eigenshape.cli.console import err, escape_text
from eigenshape.cli.interrupt import interruptible

# The first line of each verb's docstring stands here again, because `eigenshape --help` lists the
# verbs without importing their modules, which takes more than a second. A test compares the two.
VERBS = {
    "info": "Show the size, topology and faults of a shape, and which repairs would help.",
    "repair": "Repair a mesh and write it, and report what was done. All else that the file holds "
    "stays, or is named.",
    "decimate": "Write a mesh with fewer faces and the same topology, by collapsing edges.",
    "spectrum": "Compute the lowest eigenvalues of a shape and prove that none is missing.",
    "operators": "List the operators that `spectrum --operator` takes, with the shapes and options "
    "of each.",
    "features": "Find the feature points of a mesh and the parts around them, most persistent "
    "first.",
    "segment": "Cut a mesh into its parts: limbs, head, torso.",
    "label": "Copy the labels of one mesh or several to another: label a horse, and get a labeled "
    "camel.",
    "match": "Find where each point of a part, a scan or a pose lies on a whole shape.",
    "deform": "Bend, twist or stretch a mesh: a region is turned or moved, and the rest follows "
    "smoothly.",
    "pose": "Bend a mesh into the pose of another one; what corresponds is found by itself.",
    "stability": "Compare two shapes: how close they are, how their spectra change, which heat times "
    "to trust.",
    "index": "Keep an index of shapes: add meshes, list and remove shapes, check, compact, export "
    "and merge.",
    "query": "Find the shapes of an index that are most like a scan, and which features "
    "correspond.",
    "fuse": "Join scans of one shape from several sides, in any places, to one surface.",
    "compress": "Write a mesh as a small file, by the spectral coefficients of its coordinates.",
    "decompress": "Write the mesh of a file that `eigenshape compress` wrote.",
    "studio": "Open a window in the browser: bend a shape by hand, see its spectrum, heat and parts, "
    "and search.",
    "serve": "Serve an index: upload a scan, by a page or a program, and get the most similar shapes.",
    "report": "Write a shape with its spectrum, heat and parts to one HTML file that any browser "
    "opens.",
    "warm-up": "Compile the loops of spectra, search, matching, parts and bending, and keep them on "
    "disk.",
    "demo": "Try everything: make creatures, index them, scan one from one side in a new pose, and "
    "find its kind.",
}
INDEX_VERBS = {
    "add": "Describe shapes and add them to an index; a file that fails is named, and the others "
    "are still added.",
    "ls": "List the shapes of an index, with their labels, tags and attributes.",
    "rm": "Remove shapes from an index.",
    "stats": "Show how many shapes an index holds, how they are described, and the space they take.",
    "verify": "Read every byte of an index and name what is damaged.",
    "compact": "Give back the space of removed and replaced shapes.",
    "export": "Write the descriptors of shapes, and what is known of them, for other programs.",
    "merge": "Make one index of several, by copying them.",
    "convert": "Write an index of an older version anew, in the format of this one.",
    "duplicates": "List pairs of shapes that are nearly the same, wherever they lie and whatever "
    "their size.",
    "learn": "Learn a codebook from meshes, for indexes that are built in parts.",
}
NEED_NO_ARGUMENT = ("operators", "studio", "warm-up", "demo")
MARKUP: Any = "markdown"  # leaves plain brackets alone, which rich markup would take for its own

# typer brings its own copy of click since version 0.20 and used the package before; this is the
# class of usage errors of whichever is in use
UsageError: Any = typer.BadParameter.__base__


class Verb(TyperCommand):
    """A verb: errors become one line. Exit codes: 2 for a wrong option, 1 for other errors, 130 for Ctrl-C."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return options and arguments, as help lists them."""
        return _flags_without_type(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options and arguments of the verb."""
        with _printable_usage():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        try:
            with interruptible(), _printable_usage(), warnings.catch_warnings():
                warnings.simplefilter("always", UserWarning)
                warnings.showwarning = _print_warning
                return super().invoke(ctx)
        except (EigenshapeError, OSError) as error:
            text = str(error)
            if isinstance(error, OSError) and error.filename is not None:
                text = f"{error.filename}: {error.strerror}"  # without the number of the error
            err.print(f"[bold red]error:[/] {escape_text(text)}")
            raise typer.Exit(2 if isinstance(error, InvalidParameterError) else 1) from error
        except KeyboardInterrupt as error:
            err.print("stopped; what was finished is kept")
            raise typer.Exit(130) from error


class Verbs(TyperGroup):
    """The list of verbs. It holds the name and first line of each, and imports a verb when it is called."""

    lines = VERBS
    package = "eigenshape.cli"

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {name: TyperCommand(name, help=line) for name, line in self.lines.items()}

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options before the verb, as help lists them."""
        return _flags_without_type(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options before the verb."""
        with _printable_usage():
            return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Return the verb that was called, from its module."""
        with _printable_usage():
            name, found, rest = super().resolve_command(ctx, args)
        # found is None only where a shell completes a half-typed verb
        return name, self.load(str(name)) if found else None, rest

    def load(self, name: str) -> Any:
        """Import a verb's module and return its command."""
        if name == "index":
            return index_verbs()
        alone = typer.Typer(
            rich_markup_mode=MARKUP, add_completion=False, pretty_exceptions_enable=False
        )
        function = name.replace("-", "_")
        module = import_module(f"{self.package}.{function}")
        alone.command(name, cls=Verb, no_args_is_help=name not in NEED_NO_ARGUMENT)(
            getattr(module, function)
        )
        return typer.main.get_command(alone)


class IndexVerbs(Verbs):
    """The verbs of `eigenshape index`."""

    lines = INDEX_VERBS
    package = "eigenshape.cli.index"


def index_verbs() -> Any:
    """Return the command `eigenshape index`, which lists its verbs."""
    group = typer.Typer(
        name="index",
        cls=IndexVerbs,
        help=VERBS["index"],
        rich_markup_mode=MARKUP,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )

    group.callback()(lambda: None)  # without it, typer would make no group
    return typer.main.get_command(group)


def load_verb(name: str) -> Any:
    """Return the command of a verb, or of a verb of `index` such as "index add"."""
    *group, verb = name.split()
    verbs = (IndexVerbs if group else Verbs)(name=name)
    return verbs.load(verb)


def _flags_without_type(params: list[Any]) -> list[Any]:
    """Let help print `--json`, not `--json <bool>`: a flag takes no value."""
    for param in params:
        if getattr(param, "is_flag", False):
            param.display_type_rich = lambda ctx: None
    return params


@contextmanager
def _printable_usage() -> Iterator[None]:
    """Spell out control characters in words that the command does not know."""
    try:
        yield
    except UsageError as error:
        error.message = printable(error.message)
        raise


def _print_warning(message: Warning | str, *_: object, **__: object) -> None:
    err.print(f"[yellow]warning:[/] {escape_text(message)}")
