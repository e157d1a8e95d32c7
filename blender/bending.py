"""Bend a limb by hand, or by an angle."""

from math import atan2

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, StringProperty
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

import eigenshape as es

from .operation import CancelledError, Operation, Steps
from .surface import Surface, move_points, new_object

AXES = dict(zip("XYZ", np.eye(3), strict=True))
INSIDE = 0.5  # weight from which a vertex belongs to a group


class EIGENSHAPE_OT_bend(Operation, bpy.types.Operator):  # noqa: N801
    """Bend the active vertex group: move the mouse, press X, Y or Z for an axis, click to end."""

    bl_idname = "eigenshape.bend"
    bl_label = "Bend"

    group: StringProperty(
        name="Group", description="Vertex group that turns; by default, the active"
    )
    axis: FloatVectorProperty(name="Axis", description="In the world", default=(0, 0, 1))
    angle: FloatProperty(name="Angle", subtype="ANGLE")
    mode: EnumProperty(
        name="Method",
        items=[
            ("graded", "Graded", "Keeps lengths best"),
            ("uncrossed", "Uncrossed", "Is stiffer where faces would cross"),
            ("thesis", "Thesis", "The method as published"),
        ],
    )

    def steps(self, context: bpy.types.Context) -> Steps:
        """Prepare the shape, follow the mouse if there is one, and bend."""
        surface = self.read(context, context.object)
        mesh, region = surface.mesh, region_of_group(surface, self.group)
        pivot = mesh.vertices[es.deformation.region_boundary(mesh, region)].mean(axis=0)
        binding = yield lambda progress: es.deformation.bind(
            es.rig_shape(mesh, progress=progress), [region]
        )
        if self.by_hand and context.region_data is not None:
            yield from self._follow_mouse(context, surface, binding, pivot)
        turn, mode = es.Rotation(pivot, self.axis, self.angle), self.mode
        bent = yield lambda _: es.deformation.bend(binding, [turn], mode=mode)
        surface.adopt()
        # Where there are shape keys, Blender shows these, and not the vertices.
        surface.write_key("bent" if surface.data.shape_keys else None, bent.vertices)

    def _follow_mouse(
        self,
        context: bpy.types.Context,
        surface: Surface,
        binding: es.deformation.Binding,
        pivot: np.ndarray,
    ) -> Steps:
        """Turn the region as the mouse goes about its pivot, until a click; set axis and angle.

        A stand-in of triangles is bent, so that the object is as it was if Esc is pressed.
        """
        view = context.region_data
        center = location_3d_to_region_2d(context.region, view, pivot)
        towards_viewer = np.array(view.view_rotation @ Vector((0, 0, 1)))
        self.axis, start = towards_viewer, None
        preview = new_object(context, "bent", surface.mesh)
        surface.owner.hide_set(True)
        try:
            while True:
                event = yield None
                pressed = event.value == "PRESS"
                if pressed and event.type in {"ESC", "RIGHTMOUSE"}:
                    raise CancelledError
                if pressed and event.type in {"LEFTMOUSE", "RET"}:
                    return
                if pressed and event.type in AXES:
                    self.axis = AXES[event.type]
                if event.type != "MOUSEMOVE":
                    continue
                arm = Vector((event.mouse_region_x, event.mouse_region_y)) - center
                start = start or arm
                angle = atan2(start.cross(arm), start.dot(arm))
                # Counter-clockwise on the screen, also if the axis points away from the viewer
                self.angle = angle if towards_viewer @ self.axis >= 0 else -angle
                turn = es.Rotation(pivot, self.axis, self.angle)
                bent = es.deformation.bend(binding, [turn], mode=self.mode)
                move_points(preview.data, preview.data.vertices, bent.vertices)
        finally:
            bpy.data.meshes.remove(preview.data)  # and its object
            surface.owner.hide_set(False)
            surface.owner.select_set(True)


def region_of_group(surface: Surface, name: str) -> np.ndarray:
    """Return which vertices are in a vertex group, (n,) bool; without a name, in the active one."""
    names, weights = surface.group_weights()
    active = surface.owner.vertex_groups.active
    name = name or (active.name if active else "")
    if name not in names:
        raise es.InvalidParameterError(
            f"A vertex group must say what turns; {surface.owner.name!r} has the groups {names}, "
            f"and not {name!r}. Press Find Parts, or choose a group in the tab Data."
        )
    return weights[:, names.index(name)] >= INSIDE


register, unregister = bpy.utils.register_classes_factory([EIGENSHAPE_OT_bend])
