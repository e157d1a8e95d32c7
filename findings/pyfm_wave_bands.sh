#!/usr/bin/env bash
# Guess: `mesh_WKS(mesh, n)` gives n different energy bands, from low to high, for every n.
# Behavior: the width of a band is 7 / n of the range of energies, and two widths are cut off at each end. At
#   n = 28 nothing is left: all columns are equal. Below 28 the bands run from high to low, and below 14 from
#   above the spectrum to under it.
# Output: n = 100: columns differ by 0.07; n = 28: by 3e-17; n = 10: energies fall from 4.5 to -1.4
# Matters: 20 descriptors, a usual number, are few bands in reverse order, and 28 of them are one descriptor;
#   functional maps from them are badly determined, without a warning.
# Versions: pyfmaps 1.3.1, numpy 2.4.6, scipy 1.17.1, trimesh 5.2.0 (for a mesh), Python 3.11.
# Source: auto_WKS in pyFM/signatures/WKS_functions.py; Aubry, Schlickewei and Cremers 2011 choose the numbers
#   7 and 2 for 100 bands.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet pyfmaps==1.3.1 numpy==2.4.6 scipy==1.17.1 trimesh==5.2.0
env/bin/python - <<'PY'
import numpy as np
import trimesh
from pyFM import signatures
from pyFM.mesh import TriMesh

ball = trimesh.creation.icosphere(2)
mesh = TriMesh(np.array(ball.vertices) * [1.0, 1.3, 1.7], np.array(ball.faces))
mesh.process(k=60, verbose=False)


def spread(n: int) -> float:
    """Return by how much the columns of n bands differ from the first one."""
    bands = signatures.mesh_WKS(mesh, n, k=60)
    return float(np.abs(bands - bands[:, :1]).max())


print({n: spread(n) for n in (100, 28, 10)})
assert spread(100) > 0.01
assert spread(28) < 1e-12

# The bands for n = 10 are those of these energies, which fall.
low, high = np.log(mesh.eigenvalues[[1, 59]])
width = 7 * (high - low) / 10
energies = np.linspace(low + 2 * width, high - 2 * width, 10)
bands = signatures.WKS(mesh.eigenvalues, mesh.eigenvectors, energies, width, scaled=True)
print("energies for n = 10:", energies.round(2))
assert np.allclose(bands, signatures.mesh_WKS(mesh, 10, k=60))
assert (np.diff(energies) < 0).all()
PY
