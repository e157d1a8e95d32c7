"""Force what was written to disk."""

import os
from pathlib import Path


def sync_folder(folder: Path) -> None:
    """Force the names of new files to disk, on systems where a folder can be opened for that."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
