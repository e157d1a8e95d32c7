"""Shapes that the library makes, to try the studio with before one has a file."""

from functools import cache
from io import BytesIO

import numpy as np
from matplotlib.image import imsave

import eigenshape as es

SAMPLES = ("quadruped", "biped", "hand")  # each has limbs
PICTURE = 192  # pixels


@cache
def sample_mesh(kind: str) -> es.TriangleMesh:
    """Return one of the samples.

    Raises
    ------
    InvalidParameterError
        If it is none of them.
    """
    if kind not in SAMPLES:
        names = ", ".join(SAMPLES)
        raise es.InvalidParameterError(f"A sample must be one of {names}; {kind[:80]!r} is not.")
    return es.make_creature(kind, n_vertices=2500)


@cache
def sample_picture(kind: str) -> np.ndarray:
    """Return a picture of a sample, as the bytes of a PNG."""
    mesh, file = sample_mesh(kind), BytesIO()
    imsave(file, es.plot.draw(mesh, es.plot.aim_camera(mesh, size=PICTURE)).image, format="png")
    return np.frombuffer(file.getvalue(), np.uint8)
