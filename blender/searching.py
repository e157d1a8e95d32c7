"""Search for similar shapes in an index, and add shapes to it."""

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, StringProperty

import eigenshape as es

from .operation import Operation, Steps
from .surface import new_object


class Found(bpy.types.PropertyGroup):
    """A shape that the last search found; `name` is that of the index."""

    label: StringProperty()
    source: StringProperty()
    score: FloatProperty()


class EIGENSHAPE_OT_search(Operation, bpy.types.Operator):  # noqa: N801
    """Find the shapes of an index that are most similar to the active object, whole or in part."""

    bl_idname = "eigenshape.search"
    bl_label = "Search"

    folder: StringProperty(name="Index", subtype="DIR_PATH")
    n_matches: IntProperty(name="Matches", default=5, min=1)

    def steps(self, context: bpy.types.Context) -> Steps:
        """List what was found in the panel."""
        surface, n_matches = self.read(context, context.object), self.n_matches
        index = es.ShapeIndex.open(chosen_folder(self.folder))
        matches = yield lambda _: index.query(surface.mesh, n_matches=n_matches)
        found = context.window_manager.eigenshape_found
        found.clear()
        for match in matches:
            row = found.add()
            row.name, row.score = match.name, match.score
            row.label, row.source = match.label or "", match.source or ""


class EIGENSHAPE_OT_add_to_index(Operation, bpy.types.Operator):  # noqa: N801
    """Add the active object to an index under its name; an empty folder becomes one."""

    bl_idname = "eigenshape.add_to_index"
    bl_label = "Add to Index"

    folder: StringProperty(name="Index", subtype="DIR_PATH")
    label: StringProperty(name="Label", description="Class of the shape")
    replace: BoolProperty(name="Replace", description="Replace a shape of the same name")

    def steps(self, context: bpy.types.Context) -> Steps:
        """Describe the shape and store it."""
        surface, label, replace = self.read(context, context.object), self.label, self.replace
        name = surface.owner.name
        index = es.ShapeIndex.open_or_create(chosen_folder(self.folder))
        yield lambda _: index.add(name, surface.mesh, label=label or None, replace=replace)
        self.report({"INFO"}, f"{name} was added; the index has {len(index)} shapes")


class EIGENSHAPE_OT_load(Operation, bpy.types.Operator):  # noqa: N801
    """Read the file of a shape that was found, as a new object."""

    bl_idname = "eigenshape.load"
    bl_label = "Load"

    source: StringProperty(name="File", subtype="FILE_PATH")
    y_up: BoolProperty(name="Y Up", description="The file has y up, and Blender z", default=True)

    def steps(self, context: bpy.types.Context) -> Steps:
        """Add the object and make it the active one."""
        path, active = Path(self.source), context.object
        mesh = yield lambda _: es.read_mesh(path)
        made = new_object(context, path.stem, mesh)
        made.rotation_euler.x = np.pi / 2 if self.y_up else 0.0
        context.view_layer.objects.active = made
        if active is not None and max(active.dimensions):
            self.note_unit(made, active)


def chosen_folder(folder: str) -> Path:
    """Return the folder of an index, also if it begins with //, the folder of the open file."""
    if not folder:
        raise es.InvalidParameterError(
            "A folder must be chosen as the index; none is. Write its path in the panel eigenshape."
        )
    return Path(bpy.path.abspath(folder))


CLASSES = Found, EIGENSHAPE_OT_search, EIGENSHAPE_OT_add_to_index, EIGENSHAPE_OT_load


def register() -> None:
    """Add the operators, and what the panel keeps until Blender is closed."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.WindowManager.eigenshape_index = StringProperty(name="Index", subtype="DIR_PATH")
    bpy.types.WindowManager.eigenshape_found = CollectionProperty(type=Found)


def unregister() -> None:
    """Take them away again."""
    del bpy.types.WindowManager.eigenshape_found
    del bpy.types.WindowManager.eigenshape_index
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
