"""Work in the background, which the page follows by its progress."""

import re
import threading
from collections.abc import Callable
from typing import Any, Generic, Literal, TypeVar

from eigenshape_studio.memory import trim_memory

T = TypeVar("T")
Status = Literal["none", "running", "ready", "failed"]
Progress = Callable[[float, str], None]


# How the library names a repair to programs; in a window there is a button for it.
REPAIR_CALL = re.compile(r"(?:[Tt]ry|[Uu]se|by) (?:es\.)?repair\([^)]*\)[^.]*\.")


class JobCancelledError(Exception):
    """Nobody waits for a job any more; raised inside it at its next report of progress."""


class PreparingError(Exception):
    """A call asks for what is still computed; it can be sent again."""


class Job(Generic[T]):
    """One computation in a thread of its own.

    Parameters
    ----------
    work : callable
        Called as work(progress); `progress` takes the fraction done and a short message.
    shared : bool
        Whether several tabs wait for the job, so that none may cancel it.
    begin : bool
        Whether it begins now; otherwise with the first call of `start` or `wait`.
    """

    def __init__(
        self, work: Callable[[Progress], T], *, shared: bool = False, begin: bool = True
    ) -> None:
        self.status: Status = "none"
        self.progress = 0.0
        self.message = ""
        self.shared = shared
        self._work = work
        self.error: Exception | None = None
        self._result: T | None = None
        self._cancelled = threading.Event()
        self._done = threading.Event()
        self._starting = threading.Lock()
        self.begun = False
        if begin:
            self.start()

    def start(self) -> None:
        """Begin, unless it has begun."""
        with self._starting:
            if self.begun:
                return
            self.begun, self.status = True, "running"
        threading.Thread(target=self._run, daemon=True).start()

    @property
    def result(self) -> T | None:
        """What the work returned; None until it is ready."""
        return self._result

    def cancel(self) -> None:
        """Stop the work at its next report of progress, unless it is shared."""
        if self.begun and not self.shared:
            self._cancelled.set()

    def wait(self, timeout: float | None = None) -> bool:
        """Begin if that was not done, and wait until the work has ended; return whether it has."""
        self.start()
        return self._done.wait(timeout)

    def facts(self) -> dict[str, Any]:
        """Return what the page shows of the job."""
        return {"status": self.status, "progress": self.progress, "message": self.message}

    def _report(self, fraction: float, message: str) -> None:
        if self._cancelled.is_set():
            raise JobCancelledError
        self.progress, self.message = float(fraction), message

    def _run(self) -> None:
        try:
            self._result = self._work(self._report)
        except JobCancelledError:
            self.status, self.message = "none", ""
        except Exception as error:  # noqa: BLE001  whatever happens, the page must learn of it
            self.error = error
            self.status, self.message = "failed", window_message(error)
        else:
            self.progress, self.status, self.message = 1.0, "ready", ""
        finally:
            self._done.set()
            trim_memory()


def window_message(error: Exception) -> str:
    """Return what is wrong for a person at the window, who cannot call functions."""
    text = REPAIR_CALL.sub("The tab Shape offers the repairs that may help.", str(error))
    return text or type(error).__name__


NO_JOB: dict[str, Any] = {"status": "none", "progress": 0.0, "message": ""}
