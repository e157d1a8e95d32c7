"""The present shape of one tab, as all that reads and changes it sees it."""

import threading
from collections.abc import Mapping
from typing import Any

import eigenshape as es
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.folders import Folders
from eigenshape_studio.others.specimens import Specimens
from eigenshape_studio.shape.analysis import Analysis
from eigenshape_studio.shape.loading import Field, Loaded
from eigenshape_studio.shape.parse import Upload, parse_surface
from eigenshape_studio.tab.history import History, Shape


class Scene:
    """The shapes of one tab, the one that is shown, and what the page is told with the next answer.

    Parameters
    ----------
    history : History
    specimens : Specimens, optional
        Of the collection that is shown.
    folders : Folders, optional
        Those that the page may open.

    Attributes
    ----------
    warnings : list of str
        They go with the answer to the present call.
    losses : list of str
        What was there before the server began, and is gone, in sentences.
    changing : RLock
        Whoever changes something holds it.
    """

    def __init__(
        self,
        history: History,
        specimens: Specimens | None = None,
        folders: Folders | None = None,
    ) -> None:
        self.history, self.specimens, self.folders = history, specimens, folders
        self.warnings: list[str] = []
        self.losses = [] if history.file is None else [*history.file.losses]
        self.changing = threading.RLock()

    @property
    def analysis(self) -> Analysis:
        """What is computed of the shape."""
        return self.history.now.shape.analysis

    @property
    def fields(self) -> Mapping[str, Field]:
        """Functions on the vertices of the shape."""
        return self.history.now.shape.found.fields

    @property
    def attributes(self) -> es.io.MeshAttributes | None:
        """What the file of the shape holds besides."""
        return self.history.now.shape.found.attributes

    @property
    def mesh(self) -> es.TriangleMesh:
        """The shape in its present pose."""
        return self.history.mesh(self.history.now.pose)

    @property
    def edits(self) -> tuple[es.deformation.Edit, ...]:
        """The edits that lead to the present pose, oldest first."""
        return self.history.edits(self.history.now.pose)

    def listed_shape(self, number: Any) -> Shape:
        """Return a shape of the list."""
        shapes = self.history.shapes
        if not isinstance(number, int) or number not in shapes:
            raise RequestError(f"shape must be one of {[*shapes]}; it is {number!r:.80}.")
        return shapes[number]

    def require_folders(self) -> Folders:
        """Return the folders that the page may open."""
        if self.folders is None:
            raise RequestError("Folders of this machine are opened from the command line here.")
        return self.folders

    def parse(self, name: str, data: bytes) -> Upload:
        """Read a file from outside; what had to be made of points is told with the answer."""
        found = parse_surface(name, data)
        self.warnings += found.report
        return found

    def show(self, mesh: es.TriangleMesh, name: str) -> None:
        """Show another shape; those before stay in the list, with their edits."""
        self.history.show(Loaded(mesh), name, f"Open {name}")
