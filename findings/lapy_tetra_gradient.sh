#!/usr/bin/env bash
# Guess: on a tetrahedral mesh that `orient_()` has oriented, the gradient of the function x is (1, 0, 0).
# Behavior: it is (-1, 0, 0). With two corners of a tetrahedron swapped, which `is_oriented()` calls not
#   oriented, it is (1, 0, 0).
# Output: corners [0 1 2 3], oriented True: [[-1.  0.  0.]]; corners [0 2 1 3], oriented False: [[1. 0. 0.]]
# Matters: gradients of a field in a solid point down the slope. `compute_divergence` has the same sign, so
#   the error hides where both are used together.
# Versions: lapy 1.7.0, numpy 2.4.6, Python 3.11.
# Source: tet_compute_gradient in lapy/diffgeo.py, TetMesh.is_oriented in lapy/tet_mesh.py.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet lapy==1.7.0 numpy==2.4.6
env/bin/python - <<'PY'
import numpy as np
from lapy import TetMesh, diffgeo

points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def gradient_of_x(corners: list[int]) -> tuple[bool, list[float]]:
    """Return whether one tetrahedron is oriented, and the gradient of x in it."""
    mesh = TetMesh(points, np.array([corners]))
    return bool(mesh.is_oriented()), diffgeo.compute_gradient(mesh, points[:, 0])[0].tolist()


found = {str(corners): gradient_of_x(corners) for corners in ([0, 1, 2, 3], [0, 2, 1, 3])}
print(found)
assert found["[0, 1, 2, 3]"] == (True, [-1.0, 0.0, 0.0])
assert found["[0, 2, 1, 3]"] == (False, [1.0, 0.0, 0.0])
PY
