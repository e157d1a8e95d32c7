"""How a file says that a shape looks: the image, the colors of its materials and of its corners."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import eigenshape as es

MOST_IMAGES = 255  # a byte names the image of a corner
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Skin:
    """What the page draws of it. A vertex is split where its corners look different.

    Attributes
    ----------
    rows : (m, 7) float32
        Of each split vertex: the vertex, u and v (upward) in the image, red, green and blue from 0
        to 255, and the number of the image, from 1 on; 0 for none.
    corners : (f, 3) uint32
        The split vertices of the faces.
    images : tuple of bytes
        PNG or JPEG files.
    """

    rows: np.ndarray
    corners: np.ndarray
    images: tuple[bytes, ...]


def count_images(held: es.io.MeshAttributes | None) -> int:
    """Return how many images there are on a shape; -1 if nothing says how it looks."""
    if held is None:
        return -1
    n_images = len(_images(held))
    is_tinted = any(each.color[:3] != (1.0, 1.0, 1.0) for each in held.materials)
    return n_images if n_images or is_tinted or held.colors is not None else -1


def _images(held: es.io.MeshAttributes) -> list[bytes]:
    """List the images of the materials without duplicates, if the faces have places in them."""
    if held.texture_coordinates is None:
        return []
    return list(dict.fromkeys(each.image for each in held.materials if each.image))[:MOST_IMAGES]


def find_skin(held: es.io.MeshAttributes) -> Skin:
    """Return how the faces of a mesh look."""
    images, materials = _images(held), [*held.materials, es.io.Material()]  # that of number -1
    numbers = [images.index(each.image) + 1 if each.image in images else 0 for each in materials]
    layers = np.repeat(np.array(numbers)[held.face_materials], 3)
    colors = np.array([each.color[:3] for each in materials])
    tints = np.repeat(colors[held.face_materials][:, None, :], 3, axis=1)
    if held.colors is not None:
        tints = tints * held.colors[:, :, :3] / 255
    places = held.texture_coordinates
    if places is None:
        places = np.zeros((held.mesh.n_faces, 3, 2))
    parts = held.mesh.faces.ravel(), places.reshape(-1, 2), np.rint(255 * tints).reshape(-1, 3)
    table = np.column_stack([*parts, layers]).astype("<f4")
    rows, corners = np.unique(table, axis=0, return_inverse=True)
    return Skin(rows, corners.reshape(-1, 3).astype("<u4"), tuple(images))


def pack_look(held: es.io.MeshAttributes) -> tuple[list[dict[str, Any]], Arrays]:
    """Return the materials, and arrays from which `unpack_look` makes attributes again."""
    arrays: Arrays = {"face_materials": held.face_materials.astype("<i4")}
    if held.texture_coordinates is not None:
        arrays["places"] = held.texture_coordinates.astype("<f8")
    if held.colors is not None:
        arrays["colors"] = held.colors
    materials = []
    for number, each in enumerate(held.materials):
        materials.append({"name": each.name, "color": each.color, "file": each.image_name})
        if each.image is not None:
            arrays[f"image {number}"] = np.frombuffer(each.image, np.uint8)
    return materials, arrays


def unpack_look(
    mesh: es.TriangleMesh, materials: list[dict[str, Any]], arrays: Arrays
) -> es.io.MeshAttributes:
    """Return what `pack_look` was given, as far as it says how the shape looks."""
    images = [arrays.get(f"image {number}") for number in range(len(materials))]
    return replace(
        es.io.MeshAttributes.plain(mesh),
        face_materials=arrays["face_materials"].astype(np.int64),
        texture_coordinates=arrays.get("places"),
        colors=arrays.get("colors"),
        materials=tuple(
            es.io.Material(
                each["name"],
                tuple(each["color"]),
                None if image is None else image.tobytes(),
                each["file"],
            )
            for each, image in zip(materials, images, strict=True)
        ),
    )
