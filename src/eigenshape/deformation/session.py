"""A session: edits of one shape one after the other, to be seen, kept, taken back and done again."""

from collections.abc import Iterable, Sequence
from typing import SupportsIndex

import numpy as np
from jaxtyping import Float

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.deformation.binding import Binding, bind
from eigenshape.deformation.deform import Mode, bend, require_mode
from eigenshape.deformation.edits import Edit, Move, apply_edit, carry_edit
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.region import Region, region_mask
from eigenshape.deformation.rig import EigenRig, posed
from eigenshape.deformation.skeleton import SkeletonResponse, move_skeleton, skeleton_response
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh


class DeformationSession:
    """Edits of a rigged shape: `drag` shows, `commit` does, `undo` and `redo` go back and forth exactly.

    Parameters
    ----------
    rig : EigenRig
    mode : "graded", "uncrossed" or "thesis"
        How commits bend; see `bend`.

    Raises
    ------
    InvalidParameterError
        If the mode is another.
    """

    def __init__(self, rig: EigenRig, *, mode: Mode = "graded") -> None:
        require_type(rig, EigenRig, "rig")
        self._mode: Mode = require_mode(mode)
        self._poses = [rig]
        self._edits: list[Edit] = []
        self._place = 0  # how many edits count; those after it can be redone
        self._pending: tuple[Edit, Binding, SkeletonResponse] | None = None

    @property
    def rig(self) -> EigenRig:
        """The rig in its present pose."""
        return self._poses[self._place]

    @property
    def mesh(self) -> TriangleMesh:
        """The shape in its present pose; a drag does not count until it is committed."""
        return self.rig.mesh

    @property
    def edits(self) -> tuple[Edit, ...]:
        """The edits that led here, oldest first."""
        return tuple(self._edits[: self._place])

    @property
    def undone(self) -> int:
        """How many edits can be redone."""
        return len(self._edits) - self._place

    @property
    def response(self) -> SkeletonResponse:
        """What a viewer needs for the drag under way: places, and four numbers a vertex and region.

        Raises
        ------
        InvalidParameterError
            If nothing is dragged.
        """
        return self._dragged()[2]

    def drag(
        self,
        region: Region,
        handle: Handle,
        *,
        fixed: Region | None = None,
        n_modes: SupportsIndex | None = None,
    ) -> Float[np.ndarray, "n 3"]:
        """Show where a region's handle would take the shape: the moved eigen-skeleton.

        A region that is dragged again, with the same options, is not bound anew. See `drag_all`.
        """
        require_type(handle, Handle, "handle")
        return self.drag_all([Move(region, handle)], fixed=fixed, n_modes=n_modes)

    def drag_all(
        self,
        moves: Iterable[Move],
        *,
        fixed: Region | None = None,
        n_modes: SupportsIndex | None = None,
    ) -> Float[np.ndarray, "n 3"]:
        """Show where the handles of several regions would take the shape.

        Parameters
        ----------
        moves : iterable of Move
        fixed, n_modes
            As for `bind`.

        Returns
        -------
        (n, 3) float
            Vertices of the eigen-skeleton; `response` has what a viewer needs to follow the handles by itself.

        Raises
        ------
        InvalidParameterError
            As for `bind`.
        """
        number = None if n_modes is None else whole_number(n_modes, "n_modes", 1, self.rig.n_modes)
        moves = tuple(moves) if isinstance(moves, Iterable) else moves
        require_each(moves, Move, "moves")
        edit = Edit(tuple(moves), fixed, number, self._mode)
        if self._pending is None or not self._binds_alike(edit, self._pending[0]):
            binding = bind(
                self.rig, [move.region for move in edit.moves], fixed=fixed, n_modes=number
            )
            self._pending = edit, binding, skeleton_response(binding)
        self._pending = edit, *self._pending[1:]
        return move_skeleton(self.response, [move.handle for move in edit.moves])

    def _binds_alike(self, one: Edit, two: Edit) -> bool:
        if (
            one.n_modes != two.n_modes
            or len(one.moves) != len(two.moves)
            or (one.fixed is None) != (two.fixed is None)
        ):
            return False
        pairs = [(a.region, b.region) for a, b in zip(one.moves, two.moves, strict=True)]
        pairs += [(one.fixed, two.fixed)] if one.fixed is not None and two.fixed is not None else []
        return all(
            a is b or np.array_equal(region_mask(self.mesh, a), region_mask(self.mesh, b))
            for a, b in pairs
        )

    def _dragged(self) -> tuple[Edit, Binding, SkeletonResponse]:
        if self._pending is None:
            raise InvalidParameterError("A region must be dragged first; nothing is.")
        return self._pending

    def commit(self) -> TriangleMesh:
        """Bend the shape as it was dragged last, and forget what was undone.

        Raises
        ------
        InvalidParameterError
            If nothing is dragged.
        """
        edit, binding, _ = self._dragged()
        bent = bend(binding, [move.handle for move in edit.moves], mode=self._mode)
        self._advance(edit, posed(self.rig, bent.vertices))
        return self.mesh

    def apply(self, edit: Edit) -> TriangleMesh:
        """Do an edit at once, in its own mode; a drag under way is dropped.

        Raises
        ------
        InvalidParameterError
            As for `apply_edit`.
        """
        require_type(edit, Edit, "edit")
        self._advance(edit, apply_edit(self.rig, edit))
        return self.mesh

    def _advance(self, edit: Edit, rig: EigenRig) -> None:
        self._edits[self._place :] = [edit]
        self._poses[self._place + 1 :] = [rig]
        self._place += 1
        self._pending = None

    def cancel(self) -> None:
        """Drop the drag under way, if there is one."""
        self._pending = None

    def undo(self) -> TriangleMesh:
        """Go back before the last edit, to the same vertices to the last digit.

        Raises
        ------
        InvalidParameterError
            If there is none.
        """
        if not self._place:
            raise InvalidParameterError("There must be an edit to undo; there is none.")
        self._place -= 1
        self._pending = None
        return self.mesh

    def redo(self) -> TriangleMesh:
        """Go on to the edit that was undone last, to the same vertices to the last digit.

        Raises
        ------
        InvalidParameterError
            If there is none.
        """
        if not self.undone:
            raise InvalidParameterError("An edit must have been undone to be redone; none was.")
        self._place += 1
        self._pending = None
        return self.mesh


def replay(
    rig: EigenRig, edits: Sequence[Edit], *, source: MeshLike | None = None
) -> DeformationSession:
    """Do edits again, on the same shape or on another mesh of it.

    Parameters
    ----------
    rig : EigenRig
    edits : sequence of Edit
    source : MeshLike, optional
        The mesh, unbent, whose vertices the regions of the edits name, where it is another than the rig's.

    Returns
    -------
    DeformationSession

    Raises
    ------
    InvalidParameterError
        As for `bind`, of the first edit that cannot be done.
    """
    require_type(rig, EigenRig, "rig")
    require_each(edits, Edit, "edits")
    session = DeformationSession(rig)
    unbent = None if source is None else as_mesh(source, "source")
    for edit in edits:
        session.apply(edit if unbent is None else carry_edit(edit, unbent, rig.mesh))
    return session
