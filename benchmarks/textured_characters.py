"""Characters as games have them: an image on a creature, and vertices that are double along its seams."""

import zlib
from pathlib import Path

import numpy as np
import scipy.sparse

import eigenshape as es

ROWS = 64  # of the image, and as many columns


def unwrap_cylinder(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the places of the corners in the image, (f, 3, 2): angle about the upright axis, and height."""
    x, y, z = (mesh.vertices - mesh.vertices.mean(axis=0)).T
    u = np.arctan2(x, z) / (2 * np.pi) + 0.5
    v = (y - y.min()) / np.ptp(y)
    places = np.stack([u, v], axis=1)[mesh.faces]
    # A face at the back has corners at both ends of the image: it goes on beyond the end.
    at_back = np.ptp(places[:, :, 0], axis=1) > 0.5
    places[:, :, 0] += at_back[:, None] & (places[:, :, 0] < 0.5)
    return places


def unwrap_atlas(mesh: es.TriangleMesh) -> np.ndarray:
    """Return the places of the corners in the image: six charts, by where a face looks."""
    normals = es.geometry.face_normals(mesh)
    axis = np.abs(normals).argmax(axis=1)
    side = normals[np.arange(mesh.n_faces), axis] > 0
    low = mesh.vertices.min(axis=0)
    unit = (mesh.vertices - low) / np.ptp(mesh.vertices, axis=0).max()
    others = np.array([[2, 1], [0, 2], [0, 1]])[axis]
    places = np.take_along_axis(unit[mesh.faces], others[:, None, :], axis=2)
    chart = np.stack([axis / 3, side / 2], axis=1)
    return chart[:, None, :] + 0.02 + places * [0.29, 0.46]


UNWRAPPINGS = {"cylinder": unwrap_cylinder, "atlas": unwrap_atlas}


def split_seams(mesh: es.TriangleMesh, places: np.ndarray) -> tuple[es.TriangleMesh, np.ndarray]:
    """Return the mesh with a vertex for each place in the image that a vertex has, and these places."""
    rows = np.column_stack([mesh.faces.ravel(), places.reshape(-1, 2)])
    different, faces = np.unique(rows, axis=0, return_inverse=True)
    vertices = mesh.vertices[different[:, 0].astype(int)]
    return es.TriangleMesh(vertices, faces.reshape(-1, 3)), different[:, 1:]


def make_image() -> bytes:
    """Return a PNG file of squares in many colors."""
    row, column = np.indices((ROWS, ROWS))
    square = 60.0 * ((row // 4 + column // 4) % 2)
    colors = np.stack([row * 195 / ROWS, column * 195 / ROWS, np.full_like(square, 120)], axis=2)
    pixels = (colors + square[:, :, None]).astype(np.uint8)
    lines = np.concatenate([np.zeros((ROWS, 1), np.uint8), pixels.reshape(ROWS, -1)], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        end = zlib.crc32(kind + data).to_bytes(4, "big")
        return len(data).to_bytes(4, "big") + kind + data + end

    size = ROWS.to_bytes(4, "big")
    header = size + size + bytes([8, 2, 0, 0, 0])  # eight bits of red, green and blue
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines.tobytes()))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")


def write_character(path: Path, mesh: es.TriangleMesh, unwrapping: str) -> None:
    """Write a mesh with an image and seams, as OBJ with its materials beside it, or as GLB."""
    split, places = split_seams(mesh, UNWRAPPINGS[unwrapping](mesh))
    if path.suffix == ".glb":
        none = np.full(split.n_faces, -1)
        attributes = es.io.MeshAttributes(
            split,
            scipy.sparse.eye_array(3 * split.n_faces, format="csr"),
            np.zeros(split.n_faces, dtype=int),
            np.zeros(split.n_faces, dtype=int),
            none,
            texture_coordinates=places[split.faces],
            materials=(es.io.Material("skin", image=make_image(), image_name="skin.png"),),
        )
        es.write_mesh(split, path, attributes=attributes)
        return
    path.with_suffix(".png").write_bytes(make_image())
    path.with_suffix(".mtl").write_text(f"newmtl skin\nKd 1 1 1\nmap_Kd {path.stem}.png\n")
    lines = [f"mtllib {path.stem}.mtl", "usemtl skin"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in split.vertices.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in places.tolist()]
    lines += ["f " + " ".join(f"{i}/{i}" for i in face) for face in (split.faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
