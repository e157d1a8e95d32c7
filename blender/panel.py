"""The tab "eigenshape" in the sidebar of the 3D viewport (key N)."""

import bpy

ROWS = {
    "Parts": ("find_parts", "bend"),
    "Functions": ("eigenfunctions", "heat"),
}


class EIGENSHAPE_PT_panel(bpy.types.Panel):  # noqa: N801 - Blender's own form
    """Buttons of all operators, and what the last search found."""

    bl_label = "eigenshape"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "eigenshape"

    def draw(self, context: bpy.types.Context) -> None:
        """Lay out the buttons."""
        for title, names in ROWS.items():
            box = self.layout.box()
            box.label(text=title)
            for name in names:
                box.operator(f"eigenshape.{name}")
        if context.object is not None and context.object.type == "MESH":
            groups = context.object
            self.layout.template_list(
                "MESH_UL_vgroups", "", groups, "vertex_groups", groups.vertex_groups, "active_index"
            )
        box = self.layout.box()
        box.label(text="Active to Selected")
        box.operator("eigenshape.match")
        transfer = box.operator("eigenshape.match", text="Match and Transfer")
        transfer.transfer = {"WEIGHTS", "KEYS", "COLORS"}
        self._draw_search(context.window_manager)

    def _draw_search(self, manager: bpy.types.WindowManager) -> None:
        box = self.layout.box()
        box.label(text="Search")
        box.prop(manager, "eigenshape_index")
        for name in ("search", "add_to_index"):
            box.operator(f"eigenshape.{name}").folder = manager.eigenshape_index
        for found in manager.eigenshape_found:
            row = box.row()
            row.label(text=f"{found.score:.2f}  {found.name}  {found.label}")
            if found.source:
                row.operator("eigenshape.load", text="", icon="IMPORT").source = found.source


register, unregister = bpy.utils.register_classes_factory([EIGENSHAPE_PT_panel])
