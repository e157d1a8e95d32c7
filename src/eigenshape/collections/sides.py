"""Which labelled specimens are mirror images of others: their landmarks tell, where surfaces cannot."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from eigenshape._vectors import rotations_and_stretches
from eigenshape.collections.alignment import CLEAR_SIDE
from eigenshape.morphometrics.landmarks import Landmarks


def sides_of_landmarks(labelled: Mapping[str, Landmarks], template: str) -> dict[str, bool]:
    """Return, by name, whether the landmarks of a specimen are a mirror image of the others'.

    They are compared with those of the template if it has some; else most are no mirror images.
    Specimens with fewer than four common landmarks, or with flat ones, are left out.
    """
    if not labelled:
        return {}
    first = template if template in labelled else next(iter(labelled))
    found = {first: False}
    for name, landmarks in labelled.items():
        upright, reflected = _residuals(labelled[first].points, landmarks.points)
        if min(upright, reflected) < CLEAR_SIDE * max(upright, reflected):
            found[name] = reflected < upright
    if first != template and 2 * sum(found.values()) > len(found):
        found = {name: not is_mirrored for name, is_mirrored in found.items()}
    return found if len(found) > 1 else {}


def _residuals(one: Float[np.ndarray, "k 3"], two: Float[np.ndarray, "k 3"]) -> tuple[float, float]:
    """Return the least distances of two forms of unit size, by a proper and by a reflected turn."""
    known = np.isfinite(one).all(axis=1) & np.isfinite(two).all(axis=1)
    one, two = (points[known] - points[known].mean(axis=0) for points in (one, two))
    product = one.T @ two / max(float(np.linalg.norm(one) * np.linalg.norm(two)), 1e-300)
    stretches = rotations_and_stretches(product)[1]
    cosines = stretches.sum(), stretches.sum() - 2 * stretches[2]
    upright, reflected = (float(np.sqrt(max(1 - cosine**2, 0))) for cosine in cosines)
    return upright, reflected
