#!/usr/bin/env bash
# Guess: Rotation.apply, which returns a new array, takes points that may not be written to, as from_matrix and
#   align_vectors do.
# Behavior: in SciPy 1.17.1 apply, from_rotvec and from_mrp refuse a read-only array, also one that they only
#   look at; from_matrix, from_euler, from_quat and align_vectors take it. Since 1.18 all of them take it.
# Output: refused: apply, from_mrp, from_rotvec
# Matters: vertices of meshes that are shared, mapped into memory or come from other libraries are often
#   read-only, so that code which turns them works or fails with the version of SciPy.
# Versions: scipy 1.17.1, numpy 2.4.6, Python 3.11.
# Source: https://github.com/scipy/scipy/issues/24751, and pull requests 24753 and 24761.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet scipy==1.17.1 numpy==2.4.6
env/bin/python - <<'PY'
import numpy as np
from scipy.spatial.transform import Rotation

points = np.eye(3)
points.flags.writeable = False
quaternion = np.array([0.0, 0.0, 0.0, 1.0])
quaternion.flags.writeable = False
calls = {
    "apply": lambda: Rotation.identity().apply(points),
    "from_rotvec": lambda: Rotation.from_rotvec(points),
    "from_mrp": lambda: Rotation.from_mrp(points),
    "from_matrix": lambda: Rotation.from_matrix(points),
    "from_euler": lambda: Rotation.from_euler("xyz", points),
    "from_quat": lambda: Rotation.from_quat(quaternion),
    "align_vectors": lambda: Rotation.align_vectors(points, points),
}
refused = []
for name, call in calls.items():
    try:
        call()
    except ValueError as error:
        assert "read-only" in str(error)
        refused.append(name)
print("refused:", ", ".join(sorted(refused)))
assert sorted(refused) == ["apply", "from_mrp", "from_rotvec"]
PY
