#!/usr/bin/env bash
# Guess: what `write_annot` writes, `read_annot` returns: the same label at each vertex.
# Behavior: a .annot file tells parcels apart by color alone. Vertices of a black parcel come back as -1, no
#   parcel, and vertices of two parcels of one color all come back as the first one. Neither call says
#   anything.
# Output: written 0 1 2 3; read -1 1 1 3
# Matters: parcels that a program colors by itself, or that are named and black such as a medial wall, merge
#   or vanish; means by parcel are then wrong.
# Versions: nibabel 5.4.2, numpy 2.4.6, Python 3.11.
# Source: https://surfer.nmr.mgh.harvard.edu/fswiki/LabelsClutsAnnotationFiles: the annotation value of a
#   vertex is made of its color.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet nibabel==5.4.2 numpy==2.4.6
env/bin/python - <<'PY'
import numpy as np
from nibabel import freesurfer

labels = np.array([0, 1, 2, 3])
names = ["wall", "a", "b", "c"]
# Rows are red, green, blue, transparency and a value that fill_ctab computes of the color.
colors = np.array([[0, 0, 0, 0, 0], [10, 20, 30, 0, 0], [10, 20, 30, 0, 0], [40, 50, 60, 0, 0]])
freesurfer.write_annot("lh.annot", labels, colors, names, fill_ctab=True)
found, _, found_names = freesurfer.read_annot("lh.annot")
print(found.tolist(), found_names)
assert len(found_names) == 4
assert found.tolist() == [-1, 1, 1, 3]
PY
