"""Operators that compute in a thread, show progress, and end when Esc is pressed."""

import re
import warnings
from collections.abc import Callable, Generator
from concurrent.futures import Future, wait
from threading import Event, Thread
from typing import Any

import bpy
from bpy.props import BoolProperty

import eigenshape as es

from .surface import Surface, read_surface

SECONDS = 0.1  # between two looks at a thread
# Ratio of lengths from which two units are likely: those of cm and mm are 10, of inch and mm 25.4
OTHER_UNIT = 8
# What messages advise in Python and on the command line, and what it is in Blender; the repair
# "auto" welds seams and orients faces, but drops no piece
ADVICE = {
    r'Try repair\(\w+, \["(auto|weld|weld_seams|orient)"\]\).*': "Here: tick Repair.",
    r'Try repair\(\w+, \["auto", "largest_component"\]\).*': (
        "Here: tick Repair, or keep one piece of those that Mesh > Separate > By Loose Parts makes."
    ),
    r'Try repair\(\w+, \["auto", "cut_one_sided"\]\).*': (
        "Here: in Edit Mode, select a row of edges across it, and choose Mesh > Split > Faces by Edges."
    ),
    r"Create one with ShapeIndex\.create.*": (
        "Choose another folder, or press Add to Index: it makes one there."
    ),
    r'pass scale="unknown" \(.*\)': "set Scale to Unknown",
    r"add it with replace=True \(.*\)": "tick Replace",
}
Compute = Callable[[es.types.Progress], Any]
# The steps of an operator. It yields what may run in a thread, and is resumed with the result; it
# yields None for the next event of mouse or keyboard. In between it reads and writes Blender's
# data, which only Blender's own thread may do.
Steps = Generator[Compute | None, Any, None]


class CancelledError(Exception):
    """Esc was pressed."""


class Job:
    """A computation in a thread of its own, which must not touch Blender's data."""

    def __init__(self, compute: Compute) -> None:
        self.fraction = 0.0  # how much is done, 0 to 1
        self.notes: list[str] = []  # the warnings, when it is done
        self._cancelled = Event()
        self._future: Future[Any] = Future()
        # A daemon does not keep Blender open that is closed meanwhile.
        Thread(target=self._run, args=[compute], daemon=True).start()

    def _run(self, compute: Compute) -> None:
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", UserWarning)
                result = compute(self._progress)
        except BaseException as error:  # noqa: BLE001 - raised again in Blender's thread
            self._future.set_exception(error)
        else:
            self.notes = [str(each.message) for each in caught]
            self._future.set_result(result)

    def _progress(self, fraction: float, _message: str) -> None:
        if self._cancelled.is_set():
            raise CancelledError
        self.fraction = fraction

    def cancel(self) -> None:
        """End the thread when it reports progress next; its result is dropped."""
        self._cancelled.set()

    def wait(self, seconds: float) -> bool:
        """Wait for the end, at most so long; return whether it was reached."""
        return bool(wait([self._future], seconds).done)

    def result(self) -> Any:
        """Return what was computed, or raise the error that ended it."""
        return self._future.result()


class Operation:
    """What our operators have in common: a subclass gives `steps`.

    Called by a script, or again from the panel Adjust Last Operation, an operator runs to its end.
    Called by a button, it runs beside Blender, which waits, but is drawn and hears Esc.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender reads it from the class
    by_hand = False  # whether there are events to wait for

    apply_modifiers: BoolProperty(
        name="Apply Modifiers", description="Apply the modifiers first, and keep what they make"
    )
    repair: BoolProperty(
        name="Repair", description="Repair what would be refused; Blender's mesh stays as it is"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Tell whether the data can be read: in Edit Mode the mesh is not up to date."""
        cls.poll_message_set("Change to Object Mode with Tab")
        return context.mode == "OBJECT"

    def steps(self, context: bpy.types.Context) -> Steps:
        """Do the work, one step after the other."""
        raise NotImplementedError

    def read(self, context: bpy.types.Context, owner: bpy.types.Object | None) -> Surface:
        """Read the mesh of an object with the options of the operator, and report repairs."""
        if owner is not None and owner.data is not None and not owner.data.is_editable:
            raise es.InvalidParameterError(
                f"The object must belong to this file; {owner.name!r} is linked from another one. "
                "Choose Object > Relations > Make Local > Selected Objects and Data."
            )
        surface = read_surface(
            context, owner, apply_modifiers=self.apply_modifiers, repair=self.repair
        )
        for line in surface.report:
            self.report({"INFO"}, line)
        return surface

    def note_unit(
        self, one: bpy.types.Object, other: bpy.types.Object, ratio: float | None = None
    ) -> None:
        """Warn if the ratio of lengths of two objects, that of their sizes, is one of two units."""
        ratio = ratio or max(one.dimensions) / max(other.dimensions)
        if not 1 / OTHER_UNIT < ratio < OTHER_UNIT:
            self.report(
                {"WARNING"},
                f"{one.name} is {ratio:.3g} times as large as {other.name}: perhaps its unit of "
                "length is another one. If so, scale it with S, from cm to m by 0.01",
            )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run all steps, one after the other."""
        self.by_hand = False  # of an instance that was called by hand before
        state = self._begin(context)
        while state == {"RUNNING_MODAL"}:
            context.window_manager.progress_update(self._job.fraction)
            if self._job.wait(SECONDS):
                state = self._resume(context)
        return self._end(context, state)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin, and let Blender call `modal` for each event."""
        self.by_hand = True
        state = self._begin(context)
        if state != {"RUNNING_MODAL"}:
            return self._end(context, state)
        manager = context.window_manager
        self._timer = manager.event_timer_add(SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return state

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look at the thread, hear Esc, and hand on events to the steps that wait for one."""
        state = {"RUNNING_MODAL"}
        if self._job is None:
            state = self._resume(context, event)
        elif event.type == "ESC":
            self._job.cancel()
            self._steps.close()
            self.report({"INFO"}, f"{self.bl_label}: cancelled")
            state = {"CANCELLED"}
        elif event.type == "TIMER":
            context.window_manager.progress_update(self._job.fraction)
            if self._job.wait(0):
                state = self._resume(context)
        return state if state == {"RUNNING_MODAL"} else self._end(context, state)

    def _begin(self, context: bpy.types.Context) -> set[str]:
        self._timer = self._job = None
        self._steps = self.steps(context)
        context.window_manager.progress_begin(0.0, 1.0)
        return self._resume(context)

    def _resume(self, context: bpy.types.Context, event: bpy.types.Event | None = None) -> set[str]:
        """Go on to the next computation or event; return the state of the operator."""
        job, self._job = self._job, None
        try:
            result = event if job is None else job.result()
            for note in job.notes if job else ():
                self.report({"WARNING"}, advise_here(note))
            compute = self._steps.send(result)
        except StopIteration:
            return {"FINISHED"}
        except CancelledError:
            return {"CANCELLED"}
        except (es.EigenshapeError, OSError) as error:
            self.report({"ERROR"}, advise_here(str(error)))
            return {"CANCELLED"}
        except Exception:  # a fault of ours, which Blender shows: it calls nothing afterwards
            self._end(context, {"CANCELLED"})
            raise
        if compute is not None:
            self._job = Job(compute)
        return {"RUNNING_MODAL"}

    def _end(self, context: bpy.types.Context, state: set[str]) -> set[str]:
        manager = context.window_manager
        manager.progress_end()
        if self._timer is not None:
            manager.event_timer_remove(self._timer)
        return state


def advise_here(message: str) -> str:
    """Return a message of the library with what it advises as what is done in Blender."""
    for advice, here in ADVICE.items():
        message = re.sub(advice, here, message)
    return message
