#!/usr/bin/env bash
# Guess: the bottleneck distance is at most half the longest bar, since all points may go to the diagonal; e=0
#   is exact, as its documentation says.
# Behavior: `gudhi.bottleneck_distance(..., e=0)` gives more than that on two diagrams of three points; on
#   random small diagrams about one answer in 50 is too large, and with the default e one in 90.
#   `gudhi.hera.bottleneck_distance` is right.
# Output: half the longest bar 3.5; GUDHI 4.0; Hera 3.5. Second pair, default e: GUDHI 0.28; Hera 0.255
# Matters: distances, and stability bounds that are tested with them, fail now and then, by up to a seventh
#   here.
# Versions: gudhi 3.13.0, numpy 2.4.6, Python 3.11.
# Source: https://github.com/GUDHI/gudhi-devel/pull/1367, which finds an early exit in the search for
#   augmenting paths.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet gudhi==3.13.0 numpy==2.4.6
env/bin/python - <<'PY'
import gudhi
import numpy as np
from gudhi import hera

one = np.array([[7.0, 8], [6, 8], [8, 9]])
two = np.array([[2.0, 9], [1, 3], [1, 4]])
half_bar = max((death - birth) / 2 for birth, death in [*one, *two])
exact = gudhi.bottleneck_distance(one, two, 0)
print("half the longest bar", half_bar, "GUDHI", exact, "Hera", hera.bottleneck_distance(one, two, 0))
assert exact > half_bar
assert hera.bottleneck_distance(one, two, 0) == half_bar

one = np.array([[0.44, 0.67], [0.32, 0.59], [0.79, 0.87], [0.14, 0.84]])
two = np.array([[0.04, 0.73], [0.04, 0.55], [0.20, 0.22]])
# Longest to longest costs 0.11, (0.04, 0.55) to the diagonal 0.255, all others less.
possible = 0.255
near = gudhi.bottleneck_distance(one, two)
print("possible", possible, "GUDHI", near, "Hera", hera.bottleneck_distance(one, two, 0))
assert near > possible + 0.02
assert np.isclose(hera.bottleneck_distance(one, two, 0), possible)
PY
