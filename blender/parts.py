"""Parts of a mesh as vertex groups."""

import re

import bpy
import numpy as np
from bpy.props import FloatProperty

import eigenshape as es

from .operation import Operation, Steps

PART = re.compile(r"part \d+")


class EIGENSHAPE_OT_find_parts(Operation, bpy.types.Operator):  # noqa: N801 - Blender's own form
    """Find limbs, head and torso, as vertex groups, colors and the attribute "part"."""

    bl_idname = "eigenshape.find_parts"
    bl_label = "Find Parts"

    level: FloatProperty(
        name="Level", description="From coarse, -2, to fine, 2", soft_min=-2, soft_max=2
    )

    def steps(self, context: bpy.types.Context) -> Steps:
        """Put each vertex into the group of its part."""
        surface, level = self.read(context, context.object), self.level
        mesh = surface.mesh
        found = yield lambda progress: es.find_parts(mesh, level=level, progress=progress)
        surface.adopt()
        groups = surface.owner.vertex_groups
        for group in [each for each in groups if PART.fullmatch(each.name)]:
            groups.remove(group)
        labels = found.parts.labels
        parts = vertex_parts(mesh, labels)
        numbers = np.unique(labels)
        surface.write_groups([f"part {number}" for number in numbers], parts[:, None] == numbers)
        surface.write_attribute("part", parts)
        surface.write_colors(es.plot.part_colors(mesh, labels))
        groups.active_index = groups[f"part {numbers[0]}"].index
        self.report({"INFO"}, f"{surface.owner.name}: {len(numbers)} parts")


def vertex_parts(mesh: es.TriangleMesh, labels: np.ndarray) -> np.ndarray:
    """Return for each vertex the part that has most of the area around it, (n,) int."""
    areas = np.zeros((mesh.n_vertices, labels.max() + 1))
    corners = mesh.faces.ravel(), np.repeat(labels, 3)
    np.add.at(areas, corners, np.repeat(es.geometry.face_areas(mesh), 3))
    return areas.argmax(axis=1)


register, unregister = bpy.utils.register_classes_factory([EIGENSHAPE_OT_find_parts])
