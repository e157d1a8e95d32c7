"""The command `eigenshape`: Ctrl-C ends it with one line and exit code 130, also while its libraries are imported.

This module lies beside the package, not in it: whatever is imported from the package imports all of
it first, which takes a second, and this module must be there before.
"""

import os
import signal
import sys
from types import FrameType

STOPPED = 130  # 128 + SIGINT, as shells report a program that Ctrl-C has stopped


def main() -> None:
    """Run the command line."""
    # Where Ctrl-C is ignored, in a background job say, it stays ignored.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _stop)
    from eigenshape.cli import app  # noqa: PLC0415  after Ctrl-C is taken care of

    try:
        app(prog_name="eigenshape")
    except SystemExit as end:
        if end.code == STOPPED:  # what Ctrl-C left half made may complain when it is thrown away
            sys.unraisablehook = _say_nothing
        raise


def _stop(_number: int, _frame: FrameType | None) -> None:
    """End at once: before a verb begins and after it ends nothing is half done."""
    os.write(2, b"stopped\n")
    os._exit(STOPPED)


def _say_nothing(_complaint: object) -> None:
    pass


if __name__ == "__main__":
    main()
