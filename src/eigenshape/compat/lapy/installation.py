"""Our solver in LaPy's place, and LaPy's own again."""

import sys
from threading import RLock

from eigenshape._errors import MissingExtraError
from eigenshape.compat.lapy.solver import Solver

LOCK = RLock()  # one thread at a time puts a class in the place of another


class InstalledSolver(Solver):
    """`Solver` where it stands in LaPy's place: `uninstall` finds it by this class.

    `Solver` itself stays where a program has imported it from here.
    """

    theirs: type | None = None  # LaPy's class while ours stands in its place
    n_installed: int = 0  # calls of `install` that are not undone


def install() -> None:
    """Put our `Solver` in the place of LaPy's.

    It is replaced in LaPy and in every module that has imported it already (lapy.shapedna,
    lapy.heat, lapy.diffgeo, brainprint, neuromodes, ...), and as the base of classes that inherit
    from it (neuromodes.EigenSolver). Modules that are imported later find ours in LaPy. A solver
    that exists already stays LaPy's. Any thread may call this; ours stays until `uninstall` was
    called as often. Processes that are started later need a call of their own.

    Raises
    ------
    MissingExtraError
        If LaPy is not installed.

    See Also
    --------
    uninstall

    Examples
    --------
    >>> import eigenshape as es
    >>> import lapy
    >>> es.compat.lapy.install()
    >>> issubclass(lapy.Solver, es.compat.lapy.Solver)
    True
    >>> es.compat.lapy.uninstall()
    >>> issubclass(lapy.Solver, es.compat.lapy.Solver)
    False
    """
    try:
        import lapy  # noqa: PLC0415 - not needed by `Solver` itself
    except ImportError as err:
        raise MissingExtraError(
            "A solver in the place of LaPy's needs LaPy; it is not installed. Run pip install lapy."
        ) from err
    with LOCK:
        if InstalledSolver.theirs is None:
            InstalledSolver.theirs = lapy.Solver
            _replace(lapy.Solver, InstalledSolver)
        InstalledSolver.n_installed += 1


def uninstall() -> None:
    """Undo one `install`; the last one puts LaPy's own `Solver` back into its place, everywhere.

    Solvers that exist already stay ours. Without an earlier `install` nothing happens.

    See Also
    --------
    install

    Examples
    --------
    >>> import eigenshape as es
    >>> es.compat.lapy.uninstall()
    """
    with LOCK:
        InstalledSolver.n_installed = max(InstalledSolver.n_installed - 1, 0)
        if InstalledSolver.theirs is not None and not InstalledSolver.n_installed:
            _replace(InstalledSolver, InstalledSolver.theirs)
            InstalledSolver.theirs = None


def _replace(old: type, new: type) -> None:
    """Put a class in the place of another in all modules, and as a base of classes."""
    for name, module in list(sys.modules.items()):
        if name == __name__:
            continue
        # The dictionary itself: asking for a name would load what a module loads when touched.
        for key, value in list(getattr(module, "__dict__", {}).items()):
            if value is old:
                setattr(module, key, new)
    children: list[type] = old.__subclasses__()
    for child in children:
        child.__bases__ = tuple(new if base is old else base for base in child.__bases__)
