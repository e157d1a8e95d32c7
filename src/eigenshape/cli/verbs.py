"""The verbs of the command line: a list that costs nothing, and modules loaded when a verb is called."""

import inspect
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, get_args, get_origin

import typer
from typer.core import TyperCommand, TyperGroup

from certeig.kit.errors import CerteigError, InvalidParameterError
from certeig.kit.text import printable
from eigenshape.cli.console import err, escape_text
from eigenshape.cli.inputs import SHARED_PARAMETERS, option_spellings, read_parameters

# In the order in which help lists them. What each does is the first line of its docstring.
VERBS = (
    "info", "repair", "decimate", "tetrahedralize",
    "spectrum", "operators",
    "features", "condense", "segment", "label",
    "match", "transfer", "collection", "deform", "pose", "stability",
    "index", "query",
    "fuse", "compress", "decompress",
    "studio", "serve", "report", "demo",
)  # fmt: skip
INDEX_VERBS = (
    "add", "ls", "rm", "stats", "verify", "compact", "export", "merge", "duplicates", "learn",
)  # fmt: skip
# Verbs that stand in the module of another one; each of the others has a module of its name.
TOGETHER = {
    "info": "repair", "decimate": "repair", "tetrahedralize": "repair",
    "operators": "spectrum",
    "condense": "features",
    "pose": "match", "fuse": "match",
    "decompress": "compress",
    "serve": "studio", "report": "studio",
}  # fmt: skip
MARKUP: Any = "markdown"  # leaves plain brackets alone, which rich markup would take for its own

# typer brings its own copy of click since version 0.26 and used the package before; this is the
# class of usage errors of whichever is in use
UsageError: Any = typer.BadParameter.__base__


class Verb(TyperCommand):
    """A verb: errors become one line. Exit codes: 2 for a wrong option, 1 for other errors, 130 for Ctrl-C."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return options and arguments, as help lists them."""
        return _flags_without_type(super().get_params(ctx))

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        try:
            with interruptible(), warnings.catch_warnings():
                warnings.simplefilter("always", UserWarning)
                warnings.showwarning = _print_warning
                return super().invoke(ctx)
        except (CerteigError, OSError) as error:
            text = str(error)
            if isinstance(error, OSError) and error.filename is not None:
                text = f"{error.filename}: {error.strerror}"  # without the number of the error
                if isinstance(error, FileExistsError | NotADirectoryError):
                    text += ". Choose a folder instead of a file, or another name for it"
            err.print(f"[bold red]error:[/] {escape_text(text)}")
            raise typer.Exit(2 if isinstance(error, InvalidParameterError) else 1) from error
        except KeyboardInterrupt as error:
            err.print("stopped; what was finished is kept")
            raise typer.Exit(130) from error


class Verbs(TyperGroup):
    """The list of verbs. It holds the name and first line of each, and imports a verb when it is called."""

    names: tuple[str, ...] = VERBS

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {
            name: TyperCommand(name, help=first_line(self.module(name), name))
            for name in self.names
        }

    def module(self, name: str) -> str:
        """Return the module of a verb."""
        return f"eigenshape.cli.{TOGETHER.get(name, name)}"

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options before the verb, as help lists them."""
        return _flags_without_type(super().get_params(ctx))

    def make_context(self, *args: Any, **settings: Any) -> Any:
        """Read the options before the verb."""
        with _printable_usage():
            return super().make_context(*args, **settings)

    def invoke(self, ctx: Any) -> Any:
        """Read what stands after the verb, and run it."""
        with _printable_usage():
            return super().invoke(ctx)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Return the verb that was called, from its module."""
        name, found, rest = super().resolve_command(ctx, args)
        # found is None only where a shell completes a half-typed verb
        return name, self.load(str(name)) if found else None, rest

    def load(self, name: str) -> Any:
        """Import a verb's module and return its command."""
        if name == "index":
            help_text = first_line(self.module(name), name)
            return IndexVerbs(
                name=name, help=help_text, rich_markup_mode=MARKUP, no_args_is_help=True
            )
        verb = command_of(getattr(import_module(self.module(name)), name))
        parameters = inspect.signature(verb).parameters.values()
        takes_something = any(parameter.default is parameter.empty for parameter in parameters)
        alone = typer.Typer(
            rich_markup_mode=MARKUP, add_completion=False, pretty_exceptions_enable=False
        )
        alone.command(name, cls=Verb, no_args_is_help=takes_something)(verb)
        return typer.main.get_command(alone)


class IndexVerbs(Verbs):
    """The verbs of `eigenshape index`."""

    names = INDEX_VERBS

    def module(self, name: str) -> str:
        """Return the module of a verb: the same for all."""
        return "eigenshape.cli.index"


def load_verb(name: str) -> Any:
    """Return the command of a verb, or of a verb of `index` such as "index add"."""
    *group, verb = name.split()
    verbs = (IndexVerbs if group else Verbs)(name=name)
    return verbs.load(verb)


def first_line(module: str, verb: str) -> str:
    """Return what a verb does, without importing its module, which takes up to a second."""
    place = find_spec(module).origin  # type: ignore[union-attr]  # it is there
    text = Path(str(place)).read_text(encoding="utf-8")
    # `index` is no function, and has the docstring of its module.
    text = text.partition(f"\ndef {verb}(")[2] or text
    return " ".join(text.split('"""')[1].split("\n\n")[0].split())


def command_of(function: Callable[..., None]) -> Callable[..., None]:
    """Return a verb as typer takes it: with the help of each parameter, which is in the docstring.

    Parameters before the star are arguments, the others are options. One that brings a
    `typer.Option` keeps what that holds.
    """
    text, _, section = (inspect.getdoc(function) or "").partition("\n\nParameters\n----------\n")
    explained = read_parameters(SHARED_PARAMETERS) | read_parameters(section)
    parameters = []
    signature = inspect.signature(function, eval_str=True)
    for name, parameter in signature.parameters.items():
        kind, info = parameter.annotation, None
        if get_origin(kind) is Annotated:
            kind, info = get_args(kind)
        is_option = parameter.kind is parameter.KEYWORD_ONLY
        info = copy(info) or (typer.Option() if is_option else typer.Argument())
        if is_option and info.default is ... and not info.param_decls:
            info.param_decls = option_spellings(name, parameter.default)
        if not info.help:
            info.metavar, info.help = explained.get(name, (None, None))
        parameters.append(parameter.replace(annotation=Annotated[kind, info]))

    def verb(**values: Any) -> None:
        function(**values)

    verb.__doc__ = text
    verb.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return verb


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


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt while the block runs, so that what is half done is cleared away.

    Python cannot raise it everywhere: in a finalizer or a callback from C it prints a traceback
    and goes on. There Ctrl-C is repeated; and an error that comes after it counts as its consequence.
    """
    before, report = signal.getsignal(signal.SIGINT), sys.unraisablehook
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield  # ignored, as in a background job, or not ours to decide
        return
    pressed = threading.Event()

    def stop(_number: int, _frame: FrameType | None) -> None:
        pressed.set()
        raise KeyboardInterrupt

    def repeat(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            threading.Timer(0.01, signal.raise_signal, [signal.SIGINT]).start()
        elif not pressed.is_set():
            report(unraisable)

    signal.signal(signal.SIGINT, stop)
    sys.unraisablehook = repeat
    try:
        yield
    except Exception as error:
        if pressed.is_set():
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = report
        signal.signal(signal.SIGINT, before)
