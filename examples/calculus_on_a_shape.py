"""Calculus on a shape: a harmonic function and the girth along it, curvature, a flow, a flat map.

Run it as `python examples/calculus_on_a_shape.py docs/pictures`.
"""

import sys
from pathlib import Path

import numpy as np

import eigenshape as es


def main(folder: Path, *, n_vertices: int = 5000) -> dict[str, np.ndarray]:
    """Draw four pictures into a folder, and return the functions that they show."""
    giraffe = es.make_creature("giraffe", n_vertices=n_vertices)
    laplacian = es.cotangent_laplacian(giraffe)
    height = giraffe.vertices[:, 1]

    # The smoothest function that is 0 where the feet stand and 1 on the top of the head.
    feet = np.flatnonzero(height < np.quantile(height, 0.01))
    top = np.flatnonzero(height > np.quantile(height, 0.95))
    fixed = np.concatenate([feet, top])
    values = np.concatenate([np.zeros(len(feet)), np.ones(len(top))])
    up = es.calculus.solve_harmonic(laplacian, fixed, values)
    bands = np.round(15 * up) / 15
    picture = es.figure_field(giraffe, bands, "harmonic function, in bands", color_map="turbo")
    es.save_figure(picture, folder / "harmonic.png")
    levels = np.linspace(0.05, 0.95, 19)
    girths = np.array([es.calculus.level_set(giraffe, up, level).size for level in levels])

    # Mean curvature times the size of the shape: positive where the surface bulges outward.
    curvature = es.geometry.principal_curvatures(giraffe).mean
    size = es.geometry.surface_area(giraffe) ** 0.5
    shown = np.clip(curvature * size, -15, 15)
    picture = es.figure_field(giraffe, shown, "mean curvature × √area", color_map="coolwarm")
    es.save_figure(picture, folder / "curvature.png")

    # Conformal mean curvature flow at two times, each shape scaled back to the first area.
    poses = {"t = 0": giraffe}
    for share in (0.0003, 0.001):
        moved = es.calculus.mean_curvature_flow(giraffe, share * size**2, conformal=True)
        center = moved.vertices.mean(axis=0)
        factor = size / es.geometry.surface_area(moved) ** 0.5
        scaled = center + factor * (moved.vertices - center)
        poses[f"t = {share:g} area"] = es.TriangleMesh(scaled, giraffe.faces)
    es.save_figure(es.plot.figure_poses(poses), folder / "flow.png")

    # The front of a face-like dome, flattened: squares of the plane remain squares on the surface.
    dome, plane = flat_dome(n_vertices)
    cells = np.floor(plane / np.ptp(plane) * 14).astype(int)
    board = (cells.sum(axis=1) % 2).astype(float)
    picture = es.figure_field(dome, board, "checkerboard of the plane", color_map="cividis")
    es.save_figure(picture, folder / "flattened.png")
    distortion = es.calculus.angle_distortion(dome, plane)
    return {"up": up, "girths": girths, "curvature": curvature, "distortion": distortion}


def flat_dome(n_vertices: int) -> tuple[es.TriangleMesh, np.ndarray]:
    """Return a bumpy dome with boundary, and its conformal map to the plane."""
    side = max(int((6 * n_vertices) ** 0.5), 8)
    sheet = es.shapes.grid(side, side, width=2.0, height=2.0)
    x, y = sheet.vertices[:, :2].T - 1
    z = 0.9 * np.exp(-1.5 * (x * x + y * y)) + 0.25 * np.exp(-12 * ((x - 0.4) ** 2 + y * y))
    dome = es.TriangleMesh(np.column_stack([x, z, -y]), sheet.faces)
    return dome, es.calculus.flatten_conformally(dome)


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    target.mkdir(parents=True, exist_ok=True)
    found = main(target)
    print("girth along the giraffe:", found["girths"].round(3))
    print(f"angle distortion of the map: {found['distortion'].mean():.4f} on average")
