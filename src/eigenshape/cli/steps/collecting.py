"""Landmarks beside the specimens of a collection: which are given, and where a person should look."""

from dataclasses import replace

import numpy as np

from eigenshape.collections.carrying import CarriedLandmarks
from eigenshape.collections.collection import Collection
from eigenshape.collections.given_landmarks import find_landmarks

__all__ = ["find_landmarks"]  # for the verb, as it is, beside what is defined here

MOST_NAMED = 5  # specimens that a sentence names


def mostly_doubtful(carried: CarriedLandmarks) -> list[str]:
    """Name the specimens whose given landmarks are doubtful for the most part, with what is known."""
    found = []
    for row, name in enumerate(carried.specimens):
        given = carried.given[row]
        n_given, n_doubtful = given.sum(), carried.doubtful[row, given].sum()
        if 2 * n_doubtful > n_given:
            away, apart = carried.distance[row, given], carried.disagreement[row, given]
            others = f" and {np.nanmedian(apart):.3g} from where others put them"
            found.append(
                f"{n_doubtful} of {n_given} of {name} are doubtful: they lie {np.median(away):.3g} from "
                f"its surface{others if np.isfinite(apart).any() else ''} (medians). They may be of "
                "another specimen, moved, turned or mirrored."
            )
    return found


def unsure_sides(collection: Collection) -> list[str]:
    """Say, in one message or none, of which specimens it cannot be told whether they are mirrored."""
    unsure = [
        name
        for name, side in zip(collection.names, collection.sides, strict=True)
        if side == "cannot be told"
    ]
    if not unsure:
        return []
    n_all = len(collection.names)
    who = ", ".join(unsure) if len(unsure) <= MOST_NAMED else f"{len(unsure)} of {n_all} specimens"
    return [
        f"mirror images: of {who} it cannot be told whether they are mirrored, since both sides of "
        "the form are alike. Where one is, left and right are exchanged. The same landmarks on it "
        "and on another specimen tell; if none is mirrored, say so with --unmirrored."
    ]


def doubtful_landmarks(carried: CarriedLandmarks) -> dict[str, list[str]]:
    """Return the names of the doubtful landmarks of each specimen that has some."""
    names = np.array(carried.names)
    pairs = zip(carried.specimens, carried.doubtful, strict=True)
    return {specimen: names[row].tolist() for specimen, row in pairs if row.any()}


def doubtful_in_short(carried: CarriedLandmarks) -> dict[str, list[str]]:
    """Return `doubtful_landmarks`, with what is doubtful on all specimens only once, under a name for all."""
    everywhere = carried.doubtful.all(axis=0)
    of_all = np.array(carried.names)[everywhere].tolist()
    rest = doubtful_landmarks(replace(carried, doubtful=carried.doubtful & ~everywhere))
    return {"all specimens": of_all, **rest} if of_all else rest
