"""Made-up characters with texture, skin, blend shapes and a walk, as GLB files, for tests of transfer."""

import io

import numpy as np
from PIL import Image

import eigenshape as es
from eigenshape.geometry import TriangleMesh
from eigenshape.io.formats.gltf_document import Document
from eigenshape.shapes.creatures import TO_Y_UP, _rest_pose

SIZE = 256  # pixels of the texture
# Size and middle of a creature, as blend shapes and texture take them: of the place, not of the mesh
FRAME = 2.0, np.zeros(3)


def rig(kind, n_vertices, individual=0):
    """Return the rest pose, joints (j, 3) with the root first, their parents, and weights (n, j)."""
    mesh, joints = _rest_pose(kind, n_vertices, individual)
    # Swings about several axes at one place are one joint.
    first = np.unique(joints.pivots.round(9), axis=0, return_index=True)[1]
    inner_first = np.sort(first)[::-1]
    pivots, follows = joints.pivots[inner_first], joints.follows[:, inner_first].clip(0, 1)
    parents = []
    for j in range(len(pivots)):
        inside = [
            k for k in range(j) if (follows[:, j] * follows[:, k]).sum() > 0.8 * follows[:, j].sum()
        ]
        parents.append(inside[-1] + 1 if inside else 0)
    weights = np.column_stack([np.ones(mesh.n_vertices), follows])
    for j, parent in enumerate(parents):
        weights[:, parent] -= follows[:, j]
    weights = weights.clip(0)
    weights /= weights.sum(axis=1, keepdims=True)
    points = mesh.vertices[:, TO_Y_UP]
    places = np.vstack([FRAME[1], pivots[:, TO_Y_UP]])
    return TriangleMesh(points, mesh.faces), places, [-1, *parents], weights


def blend_shapes(points):
    """Return displacements of two blend shapes, which are smooth functions of the place."""
    size, middle = FRAME
    top = np.exp(-np.sum(((points - middle - [0, 0.4 * size, 0]) / (0.25 * size)) ** 2, axis=1))
    belly = np.exp(-np.sum(((points - middle) / (0.2 * size)) ** 2, axis=1))
    return {
        "look up": 0.1 * size * top[:, None] * [0.0, 0.6, 0.8],
        "breathe": 0.2 * belly[:, None] * (points - middle),
    }


def unwrap(mesh):
    """Return texture coordinates at corners, around the y axis, with a seam at the back."""
    x, y, z = ((mesh.vertices - FRAME[1]) / FRAME[0]).T
    u = np.arctan2(x, z) / (2 * np.pi) + 0.5
    corners = np.stack([u, y + 0.5], axis=1)[mesh.faces]
    # A face across the seam lies on one side of it, beyond the border of the image if need be.
    us = corners[:, :, 0]
    us += (us[:, :1] - us).round()
    return corners


def texture():
    """Return a picture, bytes of a PNG file."""
    v, u = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    bands = [0.5 + 0.5 * np.sin(2 * np.pi * (k * u + m * v)) for k, m in ((2, 1), (1, 3), (3, 0))]
    stream = io.BytesIO()
    Image.fromarray((255 * np.stack(bands, axis=2)).astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def texture_error(path, mesh, coordinates):
    """Return the mean error of pixel colors, 0 to 1, of a written character from four sides.

    It is compared with a mesh that has the same picture at given coordinates.
    """
    found, worn = es.read_mesh(path, attributes=True)
    seen = [
        _render(shape, uv, mesh)
        for shape, uv in ((found, worn.texture_coordinates), (mesh, coordinates))
    ]
    return [float(np.nanmean(np.abs(one - two))) for one, two in zip(*seen, strict=True)]


def _render(mesh, coordinates, frame, n=200_000, size=100):
    """Return four pictures of a mesh, from points on it of which the nearest to the viewer count."""
    found = es.geometry.sample_surface(mesh, n, rng=np.random.default_rng(0))
    u, v = np.einsum("pc,pcd->dp", found.weights, coordinates[found.simplices])
    picture = np.array(Image.open(io.BytesIO(texture()))) / 255
    colors = picture[(SIZE * (1 - v)).astype(int) % SIZE, (SIZE * u).astype(int) % SIZE]
    low, high = frame.vertices.min(axis=0), frame.vertices.max(axis=0)
    pixels = ((found.points - low) / (high - low).max() * (size - 1)).astype(int).clip(0, size - 1)
    pictures = []
    for axis, sign in ((2, 1), (2, -1), (0, 1), (0, -1)):
        order = np.argsort(sign * found.points[:, axis])
        across = (axis + 1) % 3, (axis + 2) % 3
        shown = np.full((size, size, 3), np.nan)
        shown[pixels[order][:, across[0]], pixels[order][:, across[1]]] = colors[order]
        pictures.append(shown)
    return pictures


def write_character(path, kind="biped", n_vertices=2000, individual=0):
    """Write a character in its rest pose; return its mesh, joints and weights."""
    mesh, places, parents, weights = rig(kind, n_vertices, individual)
    uv = unwrap(mesh)
    keys = np.column_stack([mesh.faces.ravel(), uv.reshape(-1, 2).round(9)])
    _, first, indices = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    vertices = mesh.faces.ravel()[first]
    document = Document({"asset": {"version": "2.0"}, "scene": 0})
    order = np.argsort(-weights, axis=1)[:, :4]
    shares = np.take_along_axis(weights, order, axis=1)
    shares /= shares.sum(axis=1, keepdims=True)
    normals = es.geometry.vertex_normals(mesh)
    columns = {
        "POSITION": (mesh.vertices[vertices].astype("<f4"), False),
        "NORMAL": (normals[vertices].astype("<f4"), False),
        "TEXCOORD_0": (([0, 1] + uv.reshape(-1, 2)[first] * [1, -1]).astype("<f4"), False),
        "JOINTS_0": (np.where(shares > 0, order, 0)[vertices].astype("u1"), False),
        "WEIGHTS_0": (shares[vertices].astype("<f4"), False),
    }
    shapes = blend_shapes(mesh.vertices)
    part = {
        "attributes": document.add_columns(columns),
        "indices": document.add_indices(indices.ravel(), len(first)),
        "material": 0,
        "targets": [
            document.add_columns({"POSITION": (moves[vertices].astype("<f4"), False)})
            for moves in shapes.values()
        ],
    }
    nodes = [
        {"name": f"joint {j}", "translation": (places[j] - (places[p] if p >= 0 else 0)).tolist()}
        for j, p in enumerate(parents)
    ]
    for j, p in enumerate(parents):
        if p >= 0:
            nodes[p].setdefault("children", []).append(j)
    nodes.append({"name": kind, "mesh": 0, "skin": 0})
    binds = np.tile(np.eye(4), (len(places), 1, 1))
    binds[:, :3, 3] = -places
    rows = binds.transpose(0, 2, 1).reshape(-1, 16).astype("<f4")
    times = np.array([[0.0], [1.0]], "<f4")
    step = (places[0] + [[0, 0, 0], [0, 0.1, 0]]).astype("<f4")
    document.tree |= {
        "nodes": nodes,
        "scenes": [{"nodes": [0, len(parents)]}],
        "meshes": [
            {"primitives": [part], "weights": [0.0, 0.0], "extras": {"targetNames": [*shapes]}}
        ],
        "skins": [
            {
                "joints": [*range(len(parents))],
                "inverseBindMatrices": document.add_accessor(
                    rows, document.add_view(rows.tobytes())
                ),
            }
        ],
        "animations": [
            {
                "name": "hop",
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                "samplers": [
                    {
                        "input": document.add_rows(times, min=[0.0], max=[1.0]),
                        "output": document.add_rows(step),
                    }
                ],
            }
        ],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [
            {"bufferView": document.add_view(texture()), "mimeType": "image/png", "name": "skin"}
        ],
    }
    path.write_bytes(document.pack())
    return mesh, places, weights
