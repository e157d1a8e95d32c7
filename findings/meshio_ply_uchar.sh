#!/usr/bin/env bash
# Guess: `uchar` in a PLY file is an unsigned byte, 0 to 255, in text and in binary.
# Behavior: binary files give int8, so 255 becomes -1. Text files, and binary files that call the same type
#   `uint8`, give uint8.
# Output: text uchar [255 200 128]; binary uchar [-1 -56 -128]; binary uint8 [255 200 128]
# Matters: colors and labels above 127 become negative, only in one of two encodings of one file, and only
#   under the older name of the type, which most programs write.
# Versions: meshio 5.3.5, numpy 2.4.6, Python 3.11.
# Source: https://github.com/nschloe/meshio/pull/1320, open since 2022.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet meshio==5.3.5 numpy==2.4.6
env/bin/python - <<'PY'
import struct
from pathlib import Path

import meshio

REDS = [255, 200, 128]


def red_of(form: str, kind: str) -> list[int]:
    """Write three points with a color, and return the color that meshio reads."""
    head = f"ply\nformat {form} 1.0\nelement vertex 3\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + f"property {kind} red\n"
    head += "element face 1\nproperty list uint8 int vertex_indices\nend_header\n"
    if form == "ascii":
        rows = "".join(f"{i} {i * i} 0 {red}\n" for i, red in enumerate(REDS)) + "3 0 1 2\n"
        data = rows.encode()
    else:
        points = [struct.pack("<3fB", i, i * i, 0, red) for i, red in enumerate(REDS)]
        data = b"".join(points) + struct.pack("<B3i", 3, 0, 1, 2)
    Path("a.ply").write_bytes(head.encode() + data)
    return meshio.read("a.ply").point_data["red"].tolist()


found = {
    (form, kind): red_of(form, kind)
    for form, kind in (("ascii", "uchar"), ("binary_little_endian", "uchar"), ("binary_little_endian", "uint8"))
}
print(found)
assert list(found.values()) == [REDS, [-1, -56, -128], REDS]
PY
