"""Reports on the laws of a Laplace operator: which are promised, what was measured, which hold."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from typing_extensions import TypeAliasType

from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown, html_repr

Promise = TypeAliasType(
    "Promise",
    Literal[
        "constants",  # W annihilates the constants of each component, and nothing else
        "components",  # nothing joins components of the shape
        "definite",  # nothing is annihilated, as where every component has a fixed point
        "volume",  # B adds up to the volume of the shape
        "nonnegative_weights",  # w_ij ≥ 0: the maximum principle
        "rigid_motion",
        "reflection",
        "orientation",
        "scaling",
        "union",
    ],
)

# What every Laplace operator of a shape is expected to keep, whatever it was made from.
DEFAULT_PROMISES: frozenset[Promise] = frozenset(
    ("constants", "components", "rigid_motion", "reflection", "orientation", "scaling", "union")
)


@dataclass(frozen=True)
class Law:
    """One law, and what was measured.

    Attributes
    ----------
    name : str
    holds : bool
    measured, allowed : float
        The law holds if `measured` is at most `allowed`; both are without unit.
    explanation : str
        One sentence with the numbers, and the worst entry if there is one.

    Examples
    --------
    >>> import eigenshape as es
    >>> report = es.spectral.check_laplacian(es.cotangent_laplacian(es.icosphere(2)))
    >>> law = report.laws[0]
    >>> law.name, law.holds
    ('symmetry of W', True)
    """

    name: str
    holds: bool
    measured: float
    allowed: float
    explanation: str

    _repr_html_ = html_repr


@dataclass(frozen=True)
class SkippedLaw:
    """A law that was not checked, and the reason.

    Attributes
    ----------
    name : str
    reason : str
        One sentence.

    See Also
    --------
    OperatorReport : Holds laws of both kinds.

    Examples
    --------
    >>> import eigenshape as es
    >>> report = es.spectral.check_laplacian(es.cotangent_laplacian(es.icosphere(2)))
    >>> report.skipped[0]
    SkippedLaw(name='components', reason='no mesh or graph says what belongs together')
    """

    name: str
    reason: str

    _repr_html_ = html_repr


@dataclass(frozen=True)
class OperatorReport(Shown):
    """The result of checking an operator: the laws that were checked, and those that were skipped.

    Attributes
    ----------
    laws : tuple of Law
        In the order in which they were checked.
    skipped : tuple of SkippedLaw

    Examples
    --------
    >>> import eigenshape as es
    >>> report = es.spectral.check_laplacian(es.cotangent_laplacian(es.icosphere(2)))
    >>> all(law.holds for law in report.laws)
    True
    >>> [law.name for law in report.skipped]
    ['components', 'definite', 'volume', 'nonnegative weights']
    """

    laws: tuple[Law, ...]
    skipped: tuple[SkippedLaw, ...]

    @property
    def passed(self) -> bool:
        """Whether every law that was checked holds."""
        return all(law.holds for law in self.laws)

    def explain(self) -> str:
        """Return a text with one line for each law: whether it holds, is broken, or was skipped."""
        broken = sum(not law.holds for law in self.laws)
        head = (
            f"All {len(self.laws)} laws hold."
            if self.passed
            else f"{broken} of {len(self.laws)} laws are broken."
        )
        judged = [
            f"{'holds ' if law.holds else 'BROKEN'}  {law.name}: {law.explanation}"
            for law in self.laws
        ]
        return "\n".join(
            [head, *judged, *(f"skipped {law.name}: {law.reason}" for law in self.skipped)]
        )


def make_law(name: str, measured: float, allowed: float, explanation: str) -> Law:
    """Return the law, which holds where what was measured is allowed."""
    return Law(name, bool(measured <= allowed), float(measured), float(allowed), explanation)


Outcome: TypeAlias = Law | SkippedLaw


def make_report(found: Iterable[Law | SkippedLaw]) -> OperatorReport:
    """Sort what was judged from what was not."""
    rows = list(found)
    laws = tuple(law for law in rows if isinstance(law, Law))
    return OperatorReport(laws, tuple(law for law in rows if isinstance(law, SkippedLaw)))


def check_promises(promises: Iterable[Promise]) -> frozenset[Promise]:
    """Return the promises as a set, refusing one that is unknown."""
    given = frozenset(promises)
    names = get_args(Promise.__value__)
    unknown = sorted(given - frozenset(names), key=str)
    if unknown:
        raise InvalidParameterError(
            f"promises must be among {', '.join(names)}; {unknown[0]!r} is not."
        )
    return given
