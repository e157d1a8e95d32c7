"""Two poses of a creature for tests of matching: they share their vertices."""

import numpy as np

import eigenshape as es
from eigenshape.matching.surface import UNIT, Surface, describe_surface

N_VERTICES = 600
N_POINTS = 150


def describe_poses() -> list[Surface]:
    """Describe both poses in one unit."""
    poses = [es.make_creature("quadruped", pose, n_vertices=N_VERTICES) for pose in (0, 1)]
    unit = UNIT * float(np.sqrt(es.geometry.surface_area(poses[1])))
    return [describe_surface(es.operators.denoise(pose), unit, N_POINTS) for pose in poses]
