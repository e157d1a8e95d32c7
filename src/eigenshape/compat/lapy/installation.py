"""Our solver in LaPy's place, and LaPy's own again."""

import sys

from eigenshape._errors import MissingExtraError
from eigenshape.compat.lapy.solver import Solver


class InstalledSolver(Solver):
    """`Solver` where it stands in LaPy's place: `uninstall` finds it by this class.

    `Solver` itself stays where a program has imported it from here.
    """

    theirs: type | None = None  # LaPy's class while ours stands in its place


def install() -> None:
    """Put our `Solver` in the place of LaPy's.

    It is replaced in LaPy and in every module that has imported it already (lapy.shapedna,
    lapy.heat, lapy.diffgeo, brainprint, neuromodes, ...), and as the base of classes that inherit
    from it (neuromodes.EigenSolver). Modules that are imported later find ours in LaPy. A solver
    that exists already stays LaPy's. A second call changes nothing. Processes that are started later
    need a call of their own.

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
    if InstalledSolver.theirs is None:
        InstalledSolver.theirs = lapy.Solver
        _replace(lapy.Solver, InstalledSolver)


def uninstall() -> None:
    """Put LaPy's own `Solver` back into its place, everywhere.

    Solvers that exist already stay ours. Without an earlier `install` nothing happens.

    See Also
    --------
    install

    Examples
    --------
    >>> import eigenshape as es
    >>> es.compat.lapy.uninstall()
    """
    if InstalledSolver.theirs is not None:
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
