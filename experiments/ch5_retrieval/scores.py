"""How good rankings are: hit rates, mean average precision, and how far chance alone could move them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

FOUR_LEGGED = frozenset({"fourleg", "horse", "dog", "cat", "wolf", "lion"})
TOPS = (1, 3, 5)
MEASURES = (*(f"top{top}" for top in TOPS), "map")
RESAMPLES, RESAMPLE_SEED = 2000, 11
GROUPS: dict[str, Callable[[str], bool]] = {
    "incomplete": lambda kind: kind != "complete",
    "complete": lambda kind: kind == "complete",
    "all": lambda kind: True,
}


@dataclass(frozen=True)
class Outcome:
    """What one query brought: its kind, its class, and the classes of the answers, best first."""

    kind: str
    label: str
    ranking: tuple[str, ...]


def merged(label: str) -> str:
    """Call all four-legged animals by one name."""
    return "four-legged" if label in FOUR_LEGGED else label


def four_legged_as_one(outcome: Outcome) -> Outcome:
    """Return an outcome with classes merged."""
    return Outcome(
        outcome.kind, merged(outcome.label), tuple(merged(label) for label in outcome.ranking)
    )


def measured(outcome: Outcome) -> np.ndarray:
    """Return for each of `MEASURES` what a query gets, in 0..1."""
    right = np.array([label == outcome.label for label in outcome.ranking])
    return np.array([*(float(right[:top].any()) for top in TOPS), average_precision(right)])


def average_precision(right: np.ndarray) -> float:
    """Return the mean, over all right answers, of the share of right ones among those ranked no lower; 0 if none is."""
    places = np.flatnonzero(right)
    return float(np.mean(np.arange(1, len(places) + 1) / (places + 1))) if len(places) else 0.0


def rates(outcomes: Sequence[Outcome]) -> dict[str, dict[str, list[float]]]:
    """Return for each group of queries the mean of each measure in per cent, with an interval of 95 %."""
    return by_group(np.array([measured(outcome) for outcome in outcomes]), outcomes)


def differences(
    outcomes: Sequence[Outcome], reference: Sequence[Outcome]
) -> dict[str, dict[str, list[float]]]:
    """Return the same of the differences to another method, query by query."""
    pairs = zip(outcomes, reference, strict=True)
    return by_group(np.array([measured(one) - measured(two) for one, two in pairs]), outcomes)


def by_group(table: np.ndarray, outcomes: Sequence[Outcome]) -> dict[str, dict[str, list[float]]]:
    """Return the interval of each column of a table with a row a query, for each group of queries."""
    return {
        group: {name: interval(table[rows, column]) for column, name in enumerate(MEASURES)}
        for group, rows in groups(outcomes).items()
    }


def groups(outcomes: Sequence[Outcome]) -> dict[str, np.ndarray]:
    """Return the places of the queries in each group that has any."""
    found = {
        name: np.flatnonzero([belongs(outcome.kind) for outcome in outcomes])
        for name, belongs in GROUPS.items()
    }
    return {name: rows for name, rows in found.items() if len(rows)}


def interval(values: np.ndarray) -> list[float]:
    """Return the mean of values and the 2.5th and 97.5th percentile of means of resamples, in per cent."""
    places = np.random.default_rng(RESAMPLE_SEED).integers(
        len(values), size=(RESAMPLES, len(values))
    )
    low, high = np.percentile(values[places].mean(axis=1), [2.5, 97.5])
    return [round(100 * float(number), 1) for number in (values.mean(), low, high)]
