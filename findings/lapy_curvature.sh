#!/usr/bin/env bash
# Guess: `TriaMesh.curvature()` of a sphere of radius r is 1 / r, up to the sign, and more exact on a finer
#   mesh.
# Behavior: it averages signed angles between neighboring triangles. It has no unit, is negative on a sphere
#   whose faces look outward, halves with each refinement, and does not change with the radius.
# Output: mean curvature of the unit sphere with 162, 642, 2562 vertices: -0.075, -0.042, -0.021; of radius
#   100: -0.021
# Matters: curvatures of two meshes cannot be compared, and the anisotropic operator `Solver(aniso=...)`,
#   which uses them, depends on how fine the mesh is.
# Versions: lapy 1.7.0, numpy 2.4.6, trimesh 5.2.0 (for a mesh), Python 3.11.
# Source: TriaMesh.curvature in lapy/tria_mesh.py, which cites Alliez et al. 2003; they weight each angle by
#   the length of its edge over an area.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet lapy==1.7.0 numpy==2.4.6 trimesh==5.2.0
env/bin/python - <<'PY'
import numpy as np
import trimesh
from lapy import TriaMesh


def mean_curvature(n_subdivisions: int, radius: float) -> float:
    """Return the median of the mean curvature on a sphere whose faces look outward."""
    ball = trimesh.creation.icosphere(n_subdivisions, radius)
    mesh = TriaMesh(np.array(ball.vertices), np.array(ball.faces))
    return float(np.median(mesh.curvature()[4]))


found = [mean_curvature(n, 1.0) for n in (2, 3, 4)]
large = mean_curvature(4, 100.0)
print(np.round(found, 3), "radius 100:", round(large, 3))
assert all(value < 0 for value in found)
assert 0.4 < found[2] / found[1] < 0.7
assert np.isclose(large, found[2], rtol=1e-3)
PY
