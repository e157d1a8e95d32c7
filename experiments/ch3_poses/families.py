"""Families of poses of one shape each, and how their eigenvalues differ within a family and between two."""

from itertools import combinations
from pathlib import Path

import numpy as np

FAMILIES = {
    "cat": "cat/tosca_cat",
    "centaur": "centaur/tosca_centaur",
    "david": "human/tosca_david",
    "dog": "dog/tosca_dog",
    "horse": "horse/tosca_horse",
    "michael": "human/tosca_michael",
    "victoria": "human/tosca_victoria",
    "wolf": "wolf/tosca_wolf",
    "second cat": "cat/sumner_cat",
    "second horse": "horse/sumner_horse",
    "lion": "lion/sumner_lion",
}
SPECIES = {
    "david": "human",
    "michael": "human",
    "victoria": "human",
    "second cat": "cat",
    "second horse": "horse",
}
KINDS = ("poses of one shape", "other individuals", "other species")


def paths_of(name: str, folder: Path, most: int | None = None) -> list[Path]:
    """Return the files of a family, in the order of their names."""
    return sorted(folder.glob(f"{FAMILIES[name]}*.ply"))[:most]


def kind(one: str, other: str) -> str:
    """Say what two families have in common."""
    if one == other:
        return KINDS[0]
    return KINDS[1] if SPECIES.get(one, one) == SPECIES.get(other, other) else KINDS[2]


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return |λ/λ' - 1| of each eigenvalue, the smaller below."""
    return np.maximum(one, other) / np.minimum(one, other) - 1


def mean_differences(families: dict[str, np.ndarray]) -> dict[tuple[str, str], np.ndarray]:
    """Return the mean difference of each pair of shapes, by the names of their families in the order of the table."""
    names, found = list(families), {}
    for place, one in enumerate(names):
        found[one, one] = np.array(
            [difference(*pair).mean() for pair in combinations(families[one], 2)]
        )
        for other in names[place + 1 :]:
            pairs = [difference(a, b).mean() for a in families[one] for b in families[other]]
            found[one, other] = np.array(pairs)
    return found


def by_kind(found: dict[tuple[str, str], np.ndarray]) -> dict[str, np.ndarray]:
    """Put together the pairs of each kind."""
    return {
        name: np.concatenate(
            [[], *(values for pair, values in found.items() if kind(*pair) == name)]
        )
        for name in KINDS
    }


def shown_first(near: np.ndarray, far: np.ndarray) -> float:
    """Return how often a pair of the first kind differs less than one of the second (the area under the ROC curve)."""
    return float((near[:, None] < far[None, :]).mean())


def best_threshold(near: np.ndarray, far: np.ndarray) -> tuple[float, float]:
    """Return the threshold that tells the kinds apart best, and the mean of the shares it gets right of either."""
    values = np.sort(np.concatenate([near, far]))
    middles = (values[1:] + values[:-1]) / 2
    right = [((near < middle).mean() + (far > middle).mean()) / 2 for middle in middles]
    best = int(np.argmax(right))
    return float(middles[best]), float(right[best])


def family_rows(found: dict[tuple[str, str], np.ndarray]) -> dict[str, dict[str, object]]:
    """Return for each family what its poses differ by, and by what the nearest other species does."""
    rows = {}
    for name in (one for one, other in found if one == other):
        own = found[name, name]
        others = {
            (set(pair) - {name}).pop(): values.mean()
            for pair, values in found.items()
            if name in pair and kind(*pair) == KINDS[2]
        }
        nearest = min(others, key=others.__getitem__)
        rows[name] = {
            "mean": own.mean(),
            "worst pair": own.max(),
            "nearest": nearest,
            "its mean": others[nearest],
            "ratio": others[nearest] / own.mean(),
        }
    return rows


def separation(found: dict[tuple[str, str], np.ndarray]) -> dict[str, object]:
    """Return how pairs of each kind spread, and how well a threshold tells poses from other species."""
    kinds = by_kind(found)
    rows: dict[str, object] = {
        name: {
            "pairs": len(v),
            "least": v.min(),
            "median": np.median(v),
            "mean": v.mean(),
            "most": v.max(),
        }
        for name, v in kinds.items()
        if len(v)
    }
    near, individuals, species = (kinds[name] for name in KINDS)
    rows["AUC, species"] = shown_first(near, species)
    if len(individuals):
        rows["AUC, individuals"] = shown_first(near, individuals)
    rows["threshold"], rows["right"] = best_threshold(near, species)
    return rows
