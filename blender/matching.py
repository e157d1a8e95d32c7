"""Match the active object to the selected one, and transfer what that one carries."""

import bpy
import numpy as np
from bpy.props import EnumProperty

import eigenshape as es

from .operation import Operation, Steps
from .surface import Surface, read_surface

# Sums over neighbors by which the turn of a vertex is steadied: a map of single vertices is rough.
N_ROUNDS = 5


class EIGENSHAPE_OT_match(Operation, bpy.types.Operator):  # noqa: N801
    """Find where each vertex of the active object lies on the selected one, in any pose."""

    bl_idname = "eigenshape.match"
    bl_label = "Match to Selected"

    transfer: EnumProperty(
        name="Transfer",
        description="What the active object takes over from the selected one",
        items=[
            ("WEIGHTS", "Weights", "Vertex groups"),
            ("KEYS", "Shape Keys", "Shape keys, turned as the surface is there"),
            ("COLORS", "Colors", "The active color attribute"),
            ("UVS", "UV Map", "The active UV map, with its seams cut here"),
        ],
        options={"ENUM_FLAG"},
        default=set(),
    )
    scale: EnumProperty(
        name="Scale",
        items=[
            ("auto", "Automatic", "The same unit, unless the areas say otherwise"),
            ("known", "Known", "Both objects have the same unit"),
            ("unknown", "Unknown", "Seven sizes are tried, which takes five times as long"),
        ],
    )

    def steps(self, context: bpy.types.Context) -> Steps:
        """Keep the map as the attributes "match vertex" and "match confidence", and transfer."""
        part = self.read(context, context.object)
        whole = read_surface(context, other_object(context), repair=self.repair)
        scale, wanted = self.scale, self.transfer
        colors = whole.read_colors() if "COLORS" in wanted else None
        texture = whole.read_texture() if "UVS" in wanted else None
        match = yield lambda progress: es.match_shapes(
            part.mesh, whole.mesh, scale=scale, progress=progress
        )
        part.adopt()
        part.write_attribute("match vertex", whole.sources[match.vertices])
        part.write_attribute("match confidence", match.confidence)
        part.write_colors(es.plot.value_colors(match.confidence))
        if "WEIGHTS" in wanted:
            names, weights = whole.group_weights()
            part.write_groups(names, match.pull(weights))
        if "KEYS" in wanted:
            transfer_keys(whole, part, match)
        if colors is not None:
            part.write_colors(match.pull(colors))
        if texture is not None:
            outfit = es.matching.transfer(texture, part.mesh, match=match)
            part.write_texture(whole.data.uv_layers.active.name, outfit.attributes)
        sure = match.sure().mean()
        # A part may be small; a map that fails says that the unit is not the one that was fixed
        ratio = None if scale == "known" and sure < 0.5 else match.scale
        self.note_unit(whole.owner, part.owner, ratio)
        self.report({"INFO"}, f"{sure:.0%} of the vertices are right with a probability of 0.5")
        for line in match.report:
            self.report({"INFO"}, line)


def other_object(context: bpy.types.Context) -> bpy.types.Object:
    """Return the one object that is selected beside the active one."""
    others = [each for each in context.selected_objects if each != context.object]
    if len(others) != 1:
        names = sorted(each.name for each in others)
        raise es.InvalidParameterError(
            f"One object must be selected beside the active one; these are: {names}. "
            "Click the object to match to, then the one to be matched with Shift."
        )
    return others[0]


def transfer_keys(whole: Surface, part: Surface, match: es.matching.ShapeMatch) -> None:
    """Give the part the shape keys of the whole."""
    turns = turns_between(part.mesh, match.pull(whole.mesh.vertices))
    for name, value, shift in whole.key_shifts():
        turned = np.einsum("nij,nj->ni", turns, match.pull(shift) / match.scale)
        part.write_key(name, part.mesh.vertices + turned, value)


def turns_between(part: es.TriangleMesh, images: np.ndarray) -> np.ndarray:
    """Return for each vertex the rotation (n, 3, 3) that takes the surface around its image to it.

    The one that fits the edges around the vertex and its neighbors best (Kabsch 1976).
    """
    one, two = es.geometry.edge_table(part).edges.T
    ours, theirs = (points[two] - points[one] for points in (part.vertices, images))
    covariances = np.zeros((part.n_vertices, 3, 3))
    for end in (one, two):
        np.add.at(covariances, end, ours[:, :, None] * theirs[:, None, :])
    for _ in range(N_ROUNDS):
        sums = covariances.copy()
        np.add.at(sums, one, covariances[two])
        np.add.at(sums, two, covariances[one])
        # At the same size again, as sums of sums grow
        covariances = sums / np.linalg.norm(sums, axis=(1, 2), keepdims=True).max()
    left, _, right = np.linalg.svd(covariances)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return left @ right


register, unregister = bpy.utils.register_classes_factory([EIGENSHAPE_OT_match])
