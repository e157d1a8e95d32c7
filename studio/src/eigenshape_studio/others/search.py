"""An index to search in: matches, their pictures, and their meshes."""

from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imsave

import eigenshape as es
from eigenshape.geometry.topology import submesh
from eigenshape_studio.calls import RequestError
from eigenshape_studio.shape.analysis import upright_view

THUMBNAIL = 144  # pixels
N_KEPT = 256  # pictures that are kept in memory, about 10 kB each


class Shelf:
    """An index that the studio was opened with.

    Only shapes of the index are read, by their names: a page cannot name a path.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.index = es.ShapeIndex.open(self.folder)

    def facts(self) -> dict[str, Any]:
        """Return what the page shows of the index."""
        return {"path": str(self.folder), "n_shapes": len(self.index)}

    def mesh(self, name: str) -> es.TriangleMesh:
        """Read the mesh of a shape from the file that was indexed.

        Raises
        ------
        StoreError
            If the index holds no such shape, or was built without files.
        """
        sources = {record.name: record.source for record in self.index.records()}
        if name not in sources:
            raise es.StoreError(f"A shape must be in the index to be opened; {name[:80]!r} is not.")
        source = sources[name]
        if source is None:
            raise es.StoreError(f"{name!r} was added to the index without its file.")
        return es.io.read_surface(source).mesh

    def query(
        self, mesh: es.TriangleMesh, n_matches: int, region: np.ndarray | None = None
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Search for shapes like a mesh; return names and scores, pictures and pairs of vertices.

        Parameters
        ----------
        mesh : TriangleMesh
        n_matches : int
        region : (r,) int, optional
            Vertices of a part: shapes are found that have a part like it.
        """
        part, numbers = mesh, np.arange(mesh.n_vertices)
        if region is not None:
            inside = np.asarray(np.isin(mesh.faces, region).all(axis=1))
            if not inside.any():
                raise RequestError("The part must have a face; paint a larger one.")
            part, numbers = submesh(mesh, inside)
        descriptor = es.describe(part, self.index.default_recipe())
        # One more: the shape itself may be in the index.
        found = self.index.query(descriptor, n_matches=n_matches + 1)
        itself = [match.name for match in found[:1] if _is_file_of(mesh, match.source)]
        matches, arrays = [], {}
        shown = [match for match in found if match.name not in itself][:n_matches]
        for number, match in enumerate(shown):
            facts = {
                "name": match.name,
                "label": match.label,
                "score": match.score,
                "mirrored": match.mirrored,
            }
            picture, view = _picture(match.source)
            matches.append({**facts, **view, "path": match.source})
            ours, theirs = match.correspondences.T
            ours = numbers[descriptor.vertices[ours]]
            pairs = np.column_stack([ours, match.vertices[theirs]])
            arrays[f"pairs{number}"] = pairs.astype("<u4")
            arrays[f"colors{number}"] = color_places(mesh.vertices[ours])
            if picture is not None:
                arrays[f"thumbnail{number}"] = np.frombuffer(picture, np.uint8)
        return {"matches": matches, "itself": "".join(itself)}, arrays


def _is_file_of(mesh: es.TriangleMesh, source: str | None) -> bool:
    """Say whether a file holds this very mesh."""
    try:
        kept = None if source is None else es.io.read_surface(source).mesh
    except (es.EigenshapeError, OSError):  # it has gone, or changed
        return False
    return (
        kept is not None
        and np.array_equal(kept.vertices, mesh.vertices)
        and np.array_equal(kept.faces, mesh.faces)
    )


def color_places(points: np.ndarray, within: np.ndarray | None = None) -> np.ndarray:
    """Return a color for each point, red, green, blue of 255: neighbors have similar colors.

    Colors are coordinates in the box around the points, or around those `within`.
    """
    box = points if within is None else within
    low = box.min(axis=0, initial=np.inf)
    span = np.ptp(box, axis=0) if len(box) else np.ones(3)
    shares = (points - low) / np.where(span > 0, span, 1.0)
    return np.round(40 + 215 * np.clip(shares, 0, 1)).astype(np.uint8)


def _picture(source: str | None) -> tuple[bytes | None, dict[str, list[float]]]:
    """Return the picture of a mesh file as PNG, and how it stands; nothing if it cannot be read."""
    try:
        if source is not None:
            return _draw_file(source, Path(source).stat().st_mtime_ns)
    except (es.EigenshapeError, OSError):  # the match is shown without a picture
        pass
    return None, {}


@lru_cache(maxsize=N_KEPT)
def _draw_file(source: str, _changed: int) -> tuple[bytes, dict[str, list[float]]]:
    """Draw a mesh file; a file that changes is drawn again."""
    mesh = es.io.read_surface(source).mesh
    camera = es.plot.aim_camera(mesh, size=THUMBNAIL)
    file = BytesIO()
    imsave(file, es.plot.draw(mesh, camera).image, format="png")
    return file.getvalue(), upright_view(mesh)
