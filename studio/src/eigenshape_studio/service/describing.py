"""Meshes from outside, described and drawn in worker processes with limits of time and memory."""

import asyncio
import tempfile
from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import anyio.to_thread
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.colors import to_hex
from matplotlib.image import imsave

import eigenshape as es
from eigenshape._workers import outcome_of, schedule_work, start_pool
from eigenshape.retrieval.kinds import describe_to_store
from eigenshape.retrieval.store.facts import ShapeFacts
from eigenshape_studio.others.search import color_places
from eigenshape_studio.shape.parse import Limits, read_upload

T = TypeVar("T")
Recipe = Any  # HeatRecipe or PatchRecipe
THUMBNAIL = 192  # pixels; a card of the page is 160 wide, on dense screens 320
# What is needed is repaired before a mesh is described, as `eigenshape index add` does.
REPAIRS = ("auto",)


class MeshRefusedError(Exception):
    """A mesh cannot be described or drawn; the text says why."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of a mesh, and where its vertices lie in it.

    Attributes
    ----------
    image : bytes
        PNG.
    places : (n, 2) float
        Shares of the width and of the height, right and down.
    visible : (n,) bool
        Whether nothing lies before a vertex.
    """

    image: bytes
    places: Float[np.ndarray, "n 2"]
    visible: Bool[np.ndarray, " n"]

    @property
    def n_bytes(self) -> int:
        """Return the memory that it takes."""
        return len(self.image) + self.places.nbytes + self.visible.nbytes

    def place(self, vertex: int) -> list[float] | None:
        """Return where a vertex is seen; None if it is not, or there is no such vertex."""
        if vertex >= len(self.visible) or not self.visible[vertex]:
            return None
        return [round(float(share), 4) for share in self.places[vertex]]


@dataclass(frozen=True, eq=False)
class Described:
    """What a worker returns of an uploaded mesh.

    Attributes
    ----------
    descriptor : HeatDescriptor or PatchDescriptor
    n_vertices, n_faces : int
        After the repairs.
    repairs : tuple of str
        How a surface was made of points, and what the repairs did. The numbers of vertices are
        those after the repairs.
    picture : dict, optional
        For the page: the image as a data address; place and color of each described vertex.
    """

    descriptor: Any
    n_vertices: int
    n_faces: int
    repairs: tuple[str, ...]
    picture: dict[str, Any] | None


Describe = Callable[[Recipe, bool, Path], Described]


def describe_upload(recipe: Recipe, with_picture: bool, path: Path) -> Described:
    """Read an uploaded file, repair what is needed, and describe it."""
    surface = read_upload(path, Limits().n_faces, REPAIRS)
    mesh = surface.mesh
    descriptor = es.describe(mesh, recipe)
    picture = _picture_of_query(mesh, descriptor.vertices) if with_picture else None
    return Described(descriptor, mesh.n_vertices, mesh.n_faces, surface.report, picture)


def describe_shape(recipe: Recipe, facts: ShapeFacts, path: Path) -> es.retrieval.DescribedShape:
    """Describe an uploaded file as an index keeps it: whole, from several sides, and as a picture."""
    surface = read_upload(path, Limits().n_faces, REPAIRS)
    done = {"repairs": "; ".join(surface.report)} if surface.report else {}
    return es.retrieval.DescribedShape(
        descriptors=describe_to_store(surface.mesh, recipe),
        thumbnail=es.retrieval.draw_thumbnail(surface.mesh),
        **(vars(facts) | {"attributes": {**facts.attributes, **done}}),
    )


def _picture_of_query(mesh: es.TriangleMesh, vertices: np.ndarray) -> dict[str, Any]:
    drawn = _draw(mesh)
    colors = color_places(mesh.vertices[vertices]) / 255
    return {
        "image": "data:image/png;base64," + b64encode(drawn.image).decode(),
        "points": {int(vertex): drawn.place(vertex) for vertex in vertices},
        "colors": {
            int(vertex): to_hex(color) for vertex, color in zip(vertices, colors, strict=True)
        },
    }


def draw_file(path: Path) -> Picture:
    """Draw a file of the index; its vertices are those that were described."""
    return _draw(es.io.read_surface(path, repair=REPAIRS).mesh)


def _draw(mesh: es.TriangleMesh) -> Picture:
    drawing = es.plot.draw(mesh, es.plot.aim_camera(mesh, size=THUMBNAIL))
    file = BytesIO()
    imsave(file, drawing.image, format="png")
    places = (drawing.places / THUMBNAIL).astype(np.float32)
    return Picture(file.getvalue(), places, drawing.visible)


def _load_modules(recipe: Recipe) -> None:
    """Load what the first mesh takes, so that this does not count as its time."""
    with suppress(Exception):  # the first mesh will meet the same error, and report it
        mesh = es.make_creature("fish", n_vertices=500)
        es.describe(mesh, recipe)
        _draw(mesh)


class Describers:
    """Worker processes. A mesh that hangs, dies or takes too much memory ends one, which is replaced.

    Parameters
    ----------
    workers : Workers
    recipe : HeatRecipe or PatchRecipe
        For which workers are prepared.
    describe : callable, optional
        Called in a worker as describe(recipe, with_picture, path).
    """

    def __init__(
        self, workers: es.retrieval.Workers, recipe: Recipe, describe: Describe = describe_upload
    ) -> None:
        self._workers, self._describe = workers, describe
        self._uploads = tempfile.TemporaryDirectory(prefix="eigenshape-uploads-")
        self._pool = start_pool(workers, workers.count, partial(_load_modules, recipe))

    async def describe(
        self, suffix: str, data: bytes, recipe: Recipe, *, with_picture: bool
    ) -> Described:
        """Describe the bytes of a mesh file.

        Raises
        ------
        MeshRefusedError
            If they are no mesh, or describing it reaches a limit.
        """
        return await self._run_on(suffix, data, partial(self._describe, recipe, with_picture))

    async def describe_shape(
        self, suffix: str, data: bytes, recipe: Recipe, facts: ShapeFacts
    ) -> es.retrieval.DescribedShape:
        """Describe the bytes of a mesh file to be kept; raise MeshRefusedError as `describe`."""
        return await self._run_on(suffix, data, partial(describe_shape, recipe, facts))

    async def draw(self, path: Path) -> Picture:
        """Draw a file of the index; raise MeshRefusedError if it cannot be read."""
        return await self._run(draw_file, path)

    def close(self) -> None:
        """End the workers at once."""
        self._pool.stop()
        self._pool.join()
        self._uploads.cleanup()

    def _keep(self, suffix: str, data: bytes) -> Path:
        with tempfile.NamedTemporaryFile(
            dir=self._uploads.name, suffix=suffix, delete=False
        ) as file:
            file.write(data)
            return Path(file.name)

    async def _run_on(self, suffix: str, data: bytes, work: Callable[[Path], T]) -> T:
        path = await anyio.to_thread.run_sync(self._keep, suffix, data)
        try:
            return await self._run(work, path)
        finally:
            path.unlink(missing_ok=True)

    async def _run(self, work: Callable[[Path], T], path: Path) -> T:
        try:
            future = schedule_work(self._pool, work, path, self._workers)
        except RuntimeError as error:  # the workers are being ended
            raise MeshRefusedError("it came while the service was ending") from error
        try:
            await asyncio.wait([asyncio.wrap_future(future)])
        finally:
            future.cancel()  # unless it is done: the service ends, and has waited long enough
        outcome = outcome_of(future, self._workers)
        if outcome.value is None:
            raise MeshRefusedError(outcome.error)
        return outcome.value
