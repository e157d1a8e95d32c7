"""What the service describes uploads with in tests: files that ask for it hang, die or take memory."""

import os
import time
from pathlib import Path

from eigenshape_studio.service.describing import describe_upload

SLOW_SECONDS = 1.0


def describe_or_misbehave(recipe, with_picture, path: Path):
    head = path.read_bytes()[:200]
    if b"comment hang" in head:
        time.sleep(1000)
    if b"comment die" in head:
        os._exit(9)
    if b"comment eat" in head:
        return bytearray(1 << 40)
    if b"comment slow" in head:
        time.sleep(SLOW_SECONDS)
    return describe_upload(recipe, with_picture, path)
