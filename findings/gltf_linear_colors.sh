#!/usr/bin/env bash
# Guess: a gray of 128 at the vertices is the gray 128 that viewers show after writing GLB and opening it.
# Behavior: glTF stores vertex colors in linear light. trimesh and Open3D write the value as it is, 128 / 255,
#   and read it so. By the format that is the gray 188, and viewers show it so; each library alone comes back
#   to 128, which hides the difference.
# Output: stored 0.502 by both, which is shown as 188; read as 128 by both
# Matters: colored scans look pale in every viewer, and colors from Blender or three.js look dark in Python;
#   class labels coded by colors do not match.
# Versions: trimesh 5.2.0, open3d 0.20.0, pygltflib 1.16.5 (to look into the files), numpy 2.4.6, Python 3.11.
# Source: glTF 2.0, 3.9.2 (COLOR_0 multiplies base colors as linear values),
#   https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet trimesh==5.2.0 open3d==0.20.0 pygltflib==1.16.5 numpy==2.4.6
env/bin/python - <<'PY'
import numpy as np
import open3d as o3d
import pygltflib
import trimesh


def stored_gray(path: str) -> float:
    """Return the first number of the accessor COLOR_0, as a fraction of 1."""
    tree = pygltflib.GLTF2().load(path)
    accessor = tree.accessors[tree.meshes[0].primitives[0].attributes.COLOR_0]
    view = tree.bufferViews[accessor.bufferView]
    data = tree.get_data_from_buffer_uri(tree.buffers[view.buffer].uri)
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    kind, unit = {5121: ("u1", 255), 5123: ("<u2", 65535), 5126: ("<f4", 1)}[accessor.componentType]
    return float(np.frombuffer(data, kind, 1, start)[0] / unit)


def shown(linear: float) -> int:
    """Return the gray of 0 to 255 that a screen shows, by the curve of sRGB."""
    return round(255 * (1.055 * linear ** (1 / 2.4) - 0.055))


box = trimesh.creation.box()
box.visual.vertex_colors = [128, 128, 128, 255]
for name, content in trimesh.exchange.gltf.export_gltf(box.scene()).items():
    open(name, "wb").write(content)
other = o3d.geometry.TriangleMesh.create_box()
other.paint_uniform_color([128 / 255] * 3)
o3d.io.write_triangle_mesh("other.gltf", other)
stored = [stored_gray(name) for name in ("model.gltf", "other.gltf")]
read = [int(trimesh.load_mesh("model.gltf", process=False).visual.vertex_colors[0, 0])]
read.append(round(255 * np.asarray(o3d.io.read_triangle_mesh("other.gltf").vertex_colors)[0, 0]))
print("stored", stored, "shown as", [shown(value) for value in stored], "read as", read)
assert [shown(value) for value in stored] == [188, 188]
assert read == [128, 128]
PY
