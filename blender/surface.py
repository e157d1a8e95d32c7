"""The mesh of an object as triangles in world coordinates, and values back on its own vertices."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from scipy.spatial import cKDTree

import eigenshape as es

CONVERTIBLE = ("CURVE", "SURFACE", "FONT", "META")  # types of objects of which Blender makes meshes


@dataclass(frozen=True)
class Surface:
    """A mesh as eigenshape computes with it, and the object that it was read from.

    Blender's mesh has N vertices, some of which may have no face; the triangles have n.
    """

    owner: bpy.types.Object
    data: bpy.types.Mesh  # of the owner, or a new one with its modifiers applied (see `adopt`)
    mesh: es.TriangleMesh  # in world coordinates and Blender units
    places: np.ndarray  # (N,): for each vertex of `data`, its vertex in `mesh`
    used: np.ndarray  # (N,): whether it is in `mesh` at all
    sources: np.ndarray  # (n,): for each vertex of `mesh`, a vertex of `data`
    triangles: es.TriangleMesh  # of `data`, all N vertices: `mesh` before it was repaired
    loops: np.ndarray  # (t, 3): for each corner of `triangles`, that of its polygon
    report: tuple[str, ...]  # what was repaired

    def adopt(self) -> None:
        """Give the object the mesh that was read, if its modifiers were applied."""
        if self.owner.data != self.data:
            self.owner.data = self.data
            self.owner.modifiers.clear()

    def write_attribute(self, name: str, values: np.ndarray) -> None:
        """Keep values (n,) as an attribute of the vertices: whole numbers or floats.

        Vertices without a face have the value 0.
        """
        kind, numbers = ("FLOAT", np.float32) if values.dtype.kind == "f" else ("INT", np.int32)
        attributes = self.data.attributes
        if name in attributes:
            attributes.remove(attributes[name])
        attribute = attributes.new(name, kind, "POINT")
        spread = np.where(self.used, values[self.places], 0)
        attribute.data.foreach_set("value", spread.astype(numbers))
        self.data.update()

    def write_colors(self, colors: np.ndarray) -> None:
        """Show colors (n, 3), 0 to 255, as the active color attribute."""
        attributes = self.data.color_attributes
        attribute = attributes.get("eigenshape") or attributes.new(
            "eigenshape", "BYTE_COLOR", "POINT"
        )
        rgba = np.ones((len(self.places), 4), np.float32)
        rgba[:, :3] = np.where(self.used[:, None], colors[self.places] / 255, 0.5)
        # As they look on a screen; `color` would be linear light.
        attribute.data.foreach_set("color_srgb", rgba.ravel())
        attributes.active_color = attribute
        attributes.render_color_index = attributes.active_color_index
        self.data.update()

    def write_groups(self, names: Sequence[str], weights: np.ndarray) -> None:
        """Keep weights (n, g) as vertex groups of these names, in place of what they held."""
        groups = self.owner.vertex_groups
        spread = np.where(self.used[:, None], weights[self.places], 0.0)
        for name, column in zip(names, spread.T, strict=True):
            if name in groups:
                groups.remove(groups[name])
            group = groups.new(name=name)
            # One call for each weight that occurs: a part has one.
            values, which = np.unique(column, return_inverse=True)
            order = np.argsort(which, kind="stable")
            ends = np.cumsum(np.bincount(which))
            for value, vertices in zip(values, np.split(order, ends[:-1]), strict=True):
                if value > 0:
                    group.add(vertices.tolist(), float(value), "REPLACE")

    def group_weights(self) -> tuple[list[str], np.ndarray]:
        """Return the names of the g vertex groups, and the weights (n, g)."""
        names = [group.name for group in self.owner.vertex_groups]
        weights = np.zeros((len(self.places), len(names)))
        for vertex in self.data.vertices:
            for entry in vertex.groups:
                weights[vertex.index, entry.group] = entry.weight
        return names, weights[self.sources]

    def key_shifts(self) -> Iterator[tuple[str, float, np.ndarray]]:
        """Yield the name and value of each shape key, and the vectors (n, 3) by which it moves."""
        keys = self.data.shape_keys
        linear = world_matrix(self.owner)[:3, :3]
        for key in keys.key_blocks[1:] if keys else ():
            shift = coordinates(key.data) - coordinates(key.relative_key.data)
            yield key.name, key.value, (shift @ linear.T)[self.sources]

    def read_colors(self) -> np.ndarray:
        """Return the active color attribute as it looks on a screen, (n, 3), 0 to 255."""
        attribute = self.data.color_attributes.active_color
        if attribute is None:
            raise es.InvalidParameterError(
                f"The object must have colors; {self.owner.name!r} has no color attribute. "
                "Add one in the tab Data, or untick Colors."
            )
        colors = np.empty((len(attribute.data), 4), np.float32)
        attribute.data.foreach_get("color_srgb", colors.ravel())
        if attribute.domain == "CORNER":
            corners = np.empty(len(self.data.loops), np.int32)
            self.data.loops.foreach_get("vertex_index", corners)
            sums = np.zeros((len(self.places), 4))
            np.add.at(sums, corners, colors)
            colors = sums / np.bincount(corners, minlength=len(sums)).clip(1)[:, None]
        return 255 * colors[self.sources, :3].astype(float)

    def read_texture(self) -> es.io.MeshAttributes:
        """Return the active UV map, as what `mesh` wears."""
        layer = self.data.uv_layers.active
        if layer is None:
            raise es.InvalidParameterError(
                f"The object must have a UV map; {self.owner.name!r} has none. "
                "Unwrap it in Edit Mode with U, or untick UV Map."
            )
        coordinates = np.empty((len(layer.uv), 2), np.float32)
        layer.uv.foreach_get("vector", coordinates.ravel())
        texture = coordinates[self.loops].astype(float)
        plain = es.io.MeshAttributes.plain(self.triangles)
        worn = replace(plain, texture_coordinates=texture)
        return es.io.carry_attributes(worn, self.mesh)

    def write_texture(self, name: str, worn: es.io.MeshAttributes) -> None:
        """Keep the texture coordinates of `mesh` as the active UV map."""
        texture = es.io.carry_attributes(worn, self.triangles).texture_coordinates
        polygons = np.empty(len(self.loops), np.int32)
        self.data.loop_triangles.foreach_get("polygon_index", polygons)
        texture = one_chart_each(texture, self.triangles, polygons)
        layer = self.data.uv_layers.get(name) or self.data.uv_layers.new(name=name)
        coordinates = np.empty((len(layer.uv), 2), np.float32)
        layer.uv.foreach_get("vector", coordinates.ravel())
        coordinates[self.loops[::-1]] = texture[::-1]
        layer.uv.foreach_set("vector", coordinates.ravel())
        self.data.uv_layers.active = layer
        self.data.update()

    def write_key(self, name: str | None, vertices: np.ndarray, value: float = 1.0) -> None:
        """Write places (n, 3) in the world as a shape key, or as vertices if there is no name.

        Each vertex of the object moves by the same vector as its vertex in `mesh`.
        """
        shift = (vertices - self.mesh.vertices)[self.places]
        shift[~self.used] = 0
        inverse = np.linalg.inv(world_matrix(self.owner)[:3, :3])
        moved = coordinates(self.data.vertices) + shift @ inverse.T
        points = self.data.vertices
        if name is not None:
            if self.data.shape_keys is None:
                self.owner.shape_key_add(name="Basis", from_mix=False)
            key = self.owner.shape_key_add(name=name, from_mix=False)
            key.value = value
            points = key.data
        move_points(self.data, points, moved)


def read_surface(
    context: bpy.types.Context,
    owner: bpy.types.Object | None,
    *,
    apply_modifiers: bool = False,
    repair: bool = False,
) -> Surface:
    """Read the mesh of an object.

    With `apply_modifiers` it is read as the modifiers make it, and `Surface.adopt` applies them.
    With `repair`, what eigenshape would refuse is repaired in the triangles (its repair "auto").
    Raise InvalidParameterError if there is no mesh, and InvalidShapeError if it is refused.
    """
    if owner is None:
        raise es.InvalidParameterError(
            "An object must be active; none is. Click a mesh in the viewport or the outliner."
        )
    if owner.type != "MESH":
        remedy = "Choose Object > Convert > Mesh" if owner.type in CONVERTIBLE else "Click a mesh"
        raise es.InvalidParameterError(
            f"The object must be a mesh; {owner.name!r} is of the type {owner.type}. {remedy}."
        )
    context.view_layer.update()  # for the world matrix of an object that was just moved
    data = evaluated_mesh(context, owner) if apply_modifiers and owner.modifiers else owner.data
    data.calc_loop_triangles()
    corners, loops = np.empty((2, len(data.loop_triangles), 3), np.int32)
    data.loop_triangles.foreach_get("vertices", corners.ravel())
    data.loop_triangles.foreach_get("loops", loops.ravel())
    if not corners.size:
        raise es.InvalidShapeError(
            f"The mesh must have faces; {owner.name!r} has {len(data.vertices)} vertices and no "
            "face. Fill it in Edit Mode with F, or choose another object."
        )
    world = world_matrix(owner)
    points = coordinates(data.vertices) @ world[:3, :3].T + world[:3, 3]
    orientation = np.linalg.det(world[:3, :3])
    if orientation == 0:
        raise es.InvalidParameterError(
            f"The scale must not be 0 along an axis; that of {owner.name!r} is "
            f"{tuple(owner.matrix_world.to_scale())}. Set it in the sidebar (N, Item)."
        )
    if orientation < 0:  # a mirrored object: its faces would look inward
        corners, loops = corners[:, ::-1], loops[:, ::-1]
    # Loose vertices and edges are common in Blender, and are no part of the surface.
    names = ["drop_unreferenced", "auto"] if repair else ["drop_unreferenced"]
    triangles = es.TriangleMesh(points, corners)
    done = es.repair(triangles, names)
    places, used = locate(done, points, corners)
    report = done.report if repair else ()
    return Surface(
        owner, data, done.mesh, places, used, done.source_vertices, triangles, loops, report
    )


def locate(
    done: es.geometry.RepairedMesh, points: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertex of a repaired mesh for each point (N,), and whether a face has it (N,)."""
    places = np.full(len(points), -1)
    places[done.source_vertices] = np.arange(len(done.source_vertices))
    used = np.zeros(len(points), bool)
    used[triangles] = True
    # A repair joined these with others, mostly at the same place, or dropped them.
    gone = used & (places < 0)
    if gone.any():
        places[gone] = cKDTree(done.mesh.vertices).query(points[gone])[1]
    return np.maximum(places, 0), used


def one_chart_each(
    texture: np.ndarray, triangles: es.TriangleMesh, polygons: np.ndarray
) -> np.ndarray:
    """Return texture coordinates (t, 3, 2) of which those of one polygon lie in one chart.

    Its first triangle has the chart. Corners of another one are extrapolated from there.
    """
    _, firsts, numbers = np.unique(polygons, return_index=True, return_inverse=True)
    leads = firsts[numbers]
    points = triangles.vertices[triangles.faces]
    sides = points[leads, 1:] - points[leads, :1]
    shares = (points - points[leads, :1]) @ np.linalg.pinv(sides)
    images = texture[leads, 1:] - texture[leads, :1]
    extended = texture[leads, :1] + shares @ images
    # In the chart they differ by how much the polygon is bent, elsewhere by more than its size.
    sizes = np.linalg.norm(images, axis=2).max(axis=1)
    strays = np.linalg.norm(texture - extended, axis=2) > sizes[:, None]
    return np.where(strays[:, :, None], extended, texture)


def evaluated_mesh(context: bpy.types.Context, owner: bpy.types.Object) -> bpy.types.Mesh:
    """Return a new mesh with the modifiers of an object applied."""
    if owner.data.shape_keys is not None:
        raise es.InvalidParameterError(
            f"Modifiers can only be applied to a mesh without shape keys; {owner.name!r} has "
            f"{len(owner.data.shape_keys.key_blocks)}. Untick Apply Modifiers, or remove the keys."
        )
    graph = context.evaluated_depsgraph_get()
    return bpy.data.meshes.new_from_object(
        owner.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph
    )


def coordinates(points: bpy.types.bpy_prop_collection) -> np.ndarray:
    """Return the coordinates (N, 3) of vertices or of a shape key."""
    flat = np.empty(3 * len(points), np.float32)
    points.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(float)


def move_points(
    data: bpy.types.Mesh, points: bpy.types.bpy_prop_collection, to: np.ndarray
) -> None:
    """Give vertices or a shape key of a mesh other coordinates (N, 3)."""
    points.foreach_set("co", to.astype(np.float32).ravel())
    data.update()


def world_matrix(owner: bpy.types.Object) -> np.ndarray:
    """Return the matrix (4, 4) from coordinates of an object to those of the world."""
    return np.array(owner.matrix_world, dtype=float)


def new_object(context: bpy.types.Context, name: str, mesh: es.TriangleMesh) -> bpy.types.Object:
    """Add a mesh to the scene, as it lies in the world."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices, [], mesh.faces.tolist())
    made = bpy.data.objects.new(name, data)
    context.collection.objects.link(made)
    return made
