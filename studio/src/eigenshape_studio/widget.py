"""The studio in a notebook: the same page and the same calls, in messages of a widget."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import anywidget
import traitlets

import eigenshape as es
from eigenshape.plot.camera import Up, View
from eigenshape_studio.bundle import bundle_text
from eigenshape_studio.tab.workspace import Workspace


class ShapeWidget(anywidget.AnyWidget):
    """A shape in a notebook; `es.view` makes one.

    Parameters
    ----------
    mesh : MeshLike
    values : {title: (n,) float}
        Functions on the vertices.
    name : str
    index : path, optional
        Folder of an index to search in.
    height : int
        In pixels.
    """

    height = traitlets.Int(640).tag(sync=True)

    def __init__(
        self,
        mesh: es.types.MeshLike,
        values: Mapping[str, Any] | None = None,
        *,
        name: str = "shape",
        index: str | Path | None = None,
        height: int = 640,
    ) -> None:
        self.workspace = Workspace(mesh, name, values=values, index=index)
        # Calls run beside the kernel's own thread, which stays free for the next cell.
        self._threads = ThreadPoolExecutor(max_workers=4, thread_name_prefix="studio")
        super().__init__(_esm=bundle_text(), height=height)
        self.on_msg(self._receive)

    def look_from(self, view: View = "auto", up: Up = "auto") -> None:
        """Show the shape from another side and another way up; `es.view` calls it.

        Raises
        ------
        InvalidParameterError
            If `view` or `up` is neither a name nor a direction, as in `es.plot.aim_camera`.
        """
        self.workspace.analysis.look_from(view, up)

    @property
    def mesh(self) -> es.TriangleMesh:
        """The shape in its present pose."""
        return self.workspace.mesh

    @property
    def edits(self) -> tuple[es.deformation.Edit, ...]:
        """The edits that were made by hand, oldest first."""
        return self.workspace.edits

    def close(self) -> None:
        """Stop what is still computed, and remove the widget."""
        # Python closes a widget that it forgets, also one whose shape was refused
        if "_threads" in vars(self):
            self.workspace.close()
            self._threads.shutdown(wait=False)
        super().close()

    def __repr__(self) -> str:
        return f"ShapeWidget({self.mesh!r})"

    def _receive(self, _widget: object, content: Any, buffers: list[Any]) -> None:
        """Answer a call of the page: `{id, call}` with one buffer, the message."""
        if not isinstance(content, dict) or not {"id", "call"} <= set(content):
            return
        message = bytes(buffers[0]) if len(buffers) == 1 else b""
        self._threads.submit(self._answer, content["id"], str(content["call"]), message)

    def _answer(self, number: Any, call: str, message: bytes) -> None:
        answer = self.workspace.answer(call, message)
        self.send({"id": number}, [answer.message])
