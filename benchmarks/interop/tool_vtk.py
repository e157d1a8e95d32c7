"""PyVista and VTK write and read."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyvista as pv
import vtk
from exchange import Shape, Writer, field_arrays, plain_fields, serve

KINDS = {"hexahedron": 12, "wedge": 13, "pyramid": 14, "tetra": 10}
SOLID_KINDS = {kind: name for name, kind in KINDS.items()}
SURFACE_KINDS = (5, 7, 8, 9)  # triangle, polygon, pixel, quad
# VTK orders the corners of a wedge so that its first triangle faces outward.
STRIP = 6


def surface_of(shape: Shape) -> pv.PolyData:
    """Return a surface or curves, with fields."""
    points = np.array(shape["points"])
    if "lines" in shape:
        mesh = pv.PolyData(points, lines=flat(shape["lines"]))
    else:
        mesh = pv.PolyData(points, faces=flat(shape["polygons"]))
    add_fields(mesh, shape)
    return mesh


def add_fields(mesh: pv.DataSet, shape: Shape) -> None:
    """Add what belongs to points and cells."""
    for name, values in field_arrays(shape.get("point_fields", {})).items():
        mesh.point_data[name] = values
    for name, values in field_arrays(shape.get("cell_fields", {})).items():
        mesh.cell_data[name] = values
    if "colors" in shape:
        mesh.point_data["RGB"] = np.array(shape["colors"], np.uint8)
    if "texture" in shape:
        mesh.active_texture_coordinates = np.array(shape["texture"], np.float32)


def flat(lists: list[list[int]]) -> np.ndarray:
    """Return lists as VTK takes them: each after its length."""
    return np.array([number for row in lists for number in (len(row), *row)])


def grid_of(shape: Shape) -> pv.UnstructuredGrid:
    """Return an unstructured grid of solids, or of the cells of a surface."""
    if "cells" not in shape:
        return surface_of(shape).cast_to_unstructured_grid()
    rows, kinds = [], []
    for name, cells in shape["cells"].items():
        rows += cells
        kinds += [KINDS[name]] * len(cells)
    mesh = pv.UnstructuredGrid(flat(rows), kinds, np.array(shape["points"]))
    add_fields(mesh, shape)
    return mesh


def legacy(version: int, *, binary: bool, grid: bool) -> Callable[[Shape, Path], None]:
    """Return a call that writes legacy VTK files of one version."""

    def write(shape: Shape, path: Path) -> None:
        writer = vtk.vtkUnstructuredGridWriter() if grid else vtk.vtkPolyDataWriter()
        writer.SetInputData(grid_of(shape) if grid else surface_of(shape))
        writer.SetFileName(str(path))
        writer.SetFileVersion(version)
        if binary:
            writer.SetFileTypeToBinary()
        writer.Write()

    return write


def xml(mode: str, compressor: str, *, grid: bool) -> Callable[[Shape, Path], None]:
    """Return a call that writes XML files in one encoding."""

    def write(shape: Shape, path: Path) -> None:
        writer = vtk.vtkXMLUnstructuredGridWriter() if grid else vtk.vtkXMLPolyDataWriter()
        writer.SetInputData(grid_of(shape) if grid else surface_of(shape))
        writer.SetFileName(str(path))
        getattr(writer, f"SetDataModeTo{mode}")()
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
        writer.Write()

    return write


def save(shape: Shape, path: Path) -> None:
    """Write as PyVista does by default."""
    if "colors" in shape and path.suffix == ".ply":
        surface_of(shape).save(path, texture="RGB")
    else:
        (grid_of(shape) if path.suffix == ".vtu" else surface_of(shape)).save(path)


def save_text(shape: Shape, path: Path) -> None:
    """Write text as PyVista does."""
    surface_of(shape).save(path, binary=False)


def save_scene(shape: Shape, path: Path) -> None:
    """Write a glTF file of what a window shows."""
    plotter = pv.Plotter(off_screen=True)
    mesh = surface_of(shape).triangulate()
    plotter.add_mesh(mesh, **({"scalars": "RGB", "rgb": True} if "colors" in shape else {}))
    plotter.export_gltf(path, rotate_scene=False)


def save_gltf(shape: Shape, path: Path) -> None:
    """Write by VTK's writer of models, without a window."""
    block = vtk.vtkMultiBlockDataSet()
    block.SetBlock(0, vtk.vtkMultiBlockDataSet())
    block.GetBlock(0).SetBlock(0, surface_of(shape).triangulate())
    writer = vtk.vtkGLTFWriter()
    writer.SetInputData(block)
    writer.SetFileName(str(path))
    writer.InlineDataOn()
    writer.Write()


def save_strips(shape: Shape, path: Path) -> None:
    """Write triangle strips."""
    surface_of(shape).triangulate().strip().save(path)


def save_pointed(shape: Shape, path: Path) -> None:
    """Write the surface and a cell for each of two points, which come first in the rows of cells."""
    mesh = surface_of(shape)
    pointed = pv.PolyData(mesh.points, faces=mesh.faces, verts=[1, 0, 1, 3])
    for name, values in mesh.point_data.items():
        pointed.point_data[name] = values
    for name, values in mesh.cell_data.items():
        pointed.cell_data[name] = np.concatenate([values[:2], values])
    pointed.save(path)


def read(path: Path) -> Shape:
    """Read a file by its suffix."""
    mesh = pv.read(path)
    if isinstance(mesh, pv.MultiBlock):
        mesh = mesh.combine().extract_surface(algorithm=None, pass_pointid=False, pass_cellid=False)
    if isinstance(mesh, pv.PolyData):
        mesh = mesh.triangulate() if mesh.n_strips else mesh
        mesh = mesh.cast_to_unstructured_grid()
    found: Shape = {"points": mesh.points.astype(float), "polygons": [], "cells": {}, "lines": []}
    surface, solid = [], []
    for number, (kind, corners) in enumerate(zip(mesh.celltypes, cells_of(mesh), strict=True)):
        if kind in SURFACE_KINDS:
            found["polygons"].append(corners if kind != 8 else [corners[i] for i in (0, 1, 3, 2)])
            surface.append(number)
        elif kind in SOLID_KINDS:
            found["cells"].setdefault(SOLID_KINDS[kind], []).append(corners)
            solid.append(number)
        elif kind in (3, 4):
            found["lines"].append(corners)
            solid.append(number)
    chosen = solid if solid and not surface else surface
    texture = mesh.active_texture_coordinates
    if texture is not None:
        found["texture"] = np.array(texture)[:, :2].astype(float)
        if path.suffix in (".glb", ".gltf"):  # v as in the file: downward
            found["texture"][:, 1] = 1.0 - found["texture"][:, 1]
    for name in ("RGB", "RGBA", "Colors", "COLOR_0", "Color"):
        if name in mesh.point_data and mesh.point_data[name].ndim == 2:
            colors = np.asarray(mesh.point_data[name])
            found["colors"] = colors if colors.dtype == np.uint8 else light_colors(colors)
    found["point_fields"] = plain_fields(mesh.point_data)
    found["cell_fields"] = plain_fields(
        {k: np.asarray(v)[chosen] for k, v in mesh.cell_data.items()}
    )
    return found


def light_colors(colors: np.ndarray) -> np.ndarray:
    """Return linear light, as glTF stores it, as a screen shows it."""
    share = colors[:, :3] / (1.0 if colors.dtype.kind == "f" else np.iinfo(colors.dtype).max)
    share = share.astype(float)
    return 255 * np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)


def cells_of(mesh: pv.UnstructuredGrid) -> list[list[int]]:
    """Return the corners of each cell."""
    pieces = np.split(mesh.cell_connectivity, mesh.offset[1:-1]) if mesh.n_cells else []
    return [piece.tolist() for piece in pieces]


if __name__ == "__main__":
    faces = ("prism", "hole", "seam", "colors", "fields", "far")
    grids = ("prism", "fields", "solids", "curves", "far")
    geometry = ("prism", "hole", "seam", "far")
    serve(
        f"{pv.__version__}, VTK {vtk.VTK_VERSION}",
        {
            "VTP": Writer(".vtp", save, (*faces, "curves")),
            "VTP, text": Writer(".vtp", xml("Ascii", "None", grid=False), faces),
            "VTP, binary LZ4": Writer(".vtp", xml("Binary", "LZ4", grid=False), faces),
            "VTP, points beside faces": Writer(".vtp", save_pointed, ("fields",)),
            "VTU": Writer(".vtu", save, grids),
            "VTU, text": Writer(".vtu", xml("Ascii", "None", grid=True), grids),
            "VTU, binary ZLib": Writer(".vtu", xml("Binary", "ZLib", grid=True), grids),
            "VTU, appended LZMA": Writer(".vtu", xml("Appended", "LZMA", grid=True), grids),
            "VTU, appended LZ4": Writer(".vtu", xml("Appended", "LZ4", grid=True), grids),
            "VTK": Writer(".vtk", save, (*faces, "curves")),
            "VTK 5.1, text": Writer(".vtk", legacy(51, binary=False, grid=False), faces),
            "VTK 4.2": Writer(".vtk", legacy(42, binary=True, grid=False), faces),
            "VTK 4.2, text": Writer(".vtk", legacy(42, binary=False, grid=False), faces),
            "VTK 5.1, grid": Writer(".vtk", legacy(51, binary=True, grid=True), grids),
            "VTK 4.2, grid": Writer(".vtk", legacy(42, binary=True, grid=True), grids),
            "VTK 5.1, grid, text": Writer(".vtk", legacy(51, binary=False, grid=True), grids),
            "VTK, strips": Writer(".vtk", save_strips, ("seam", "far")),
            "VTK, points beside faces": Writer(".vtk", save_pointed, ("fields",)),
            "PLY": Writer(".ply", save, ("prism", "hole", "seam", "colors", "far")),
            "PLY, text": Writer(".ply", save_text, ("prism", "far")),
            "STL": Writer(".stl", save, ("seam", "far")),
            "STL, text": Writer(".stl", save_text, ("seam", "far")),
            "OBJ": Writer(".obj", save, geometry),
            "glTF, models": Writer(".gltf", save_gltf, ("prism", "seam", "far", "colors")),
            "glTF, window": Writer(".gltf", save_scene, ("prism", "seam", "far", "colors")),
        },
        dict.fromkeys((".vtp", ".vtu", ".vtk", ".ply", ".stl", ".obj", ".glb", ".gltf"), read),
    )
