"""Discs along a surface, of which the brush of the page makes its strokes."""

import threading
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import RequestError


class Brush:
    """Discs on a mesh. A stroke asks for many, so what they have in common is kept."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # The mesh that was last painted on, and the function that computes distances on it.
        self._waves: tuple[Any, Any] = (None, None)

    def disc(self, mesh: es.TriangleMesh, tail: str) -> np.ndarray:
        """Return the vertices within a geodesic radius of a vertex; `tail` is "vertex/radius".

        Raises
        ------
        RequestError
            If it names no vertex of the mesh, or no radius.
        """
        vertex, _, radius = tail.partition("/")
        try:
            source, reach = int(vertex), float(radius)
        except ValueError as err:
            raise RequestError(
                f"A disc must be named by its vertex and its radius, as 'disc/7/0.5'; not {tail[:80]!r}."
            ) from err
        if not (0 <= source < mesh.n_vertices and 0 < reach < np.inf):
            raise RequestError(
                f"A disc must have one of the {mesh.n_vertices} vertices and a positive, finite "
                f"radius; it has vertex {source} and radius {reach:g}."
            )
        with self._lock:
            if mesh is not self._waves[0]:
                self._waves = mesh, es.geometry.geodesic_waves(mesh)
            wave = self._waves[1]
        return np.flatnonzero(wave(source, reach) <= reach).astype("<u4")
