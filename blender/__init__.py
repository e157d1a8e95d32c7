"""The extension of Blender: parts, bending, matching, transfer, functions and search of meshes."""

from . import bending, functions, matching, panel, parts, searching

MODULES = parts, bending, matching, functions, searching, panel


def register() -> None:
    """Add the operators and the panel to Blender."""
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Take them away again, the last one first."""
    for module in reversed(MODULES):
        module.unregister()
