"""Ctrl-C while a verb runs."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt while the block runs, so that what is half done is cleared away.

    Python cannot raise it everywhere: in a finalizer or in a callback from C, of which compiling
    has many, it prints a traceback and goes on. There Ctrl-C is repeated; and an error that comes
    after it counts as its consequence.
    """
    before, report = signal.getsignal(signal.SIGINT), sys.unraisablehook
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield  # ignored, as in a background job, or not ours to decide
        return
    pressed = threading.Event()

    def stop(_number: int, _frame: FrameType | None) -> None:
        pressed.set()
        raise KeyboardInterrupt

    def repeat(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            threading.Timer(0.01, signal.raise_signal, [signal.SIGINT]).start()
        elif not pressed.is_set():
            report(unraisable)

    signal.signal(signal.SIGINT, stop)
    sys.unraisablehook = repeat
    try:
        yield
    except Exception as error:
        if pressed.is_set():
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = report
        signal.signal(signal.SIGINT, before)
