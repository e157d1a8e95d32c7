"""How far do eigenspaces turn, and do gaps say how far? (thesis 3.5).

A lion with noise of four strengths and in four poses, all with the same faces. The largest principal angle of each group
of eigenvectors is compared with the gap around its eigenvalues and with the bound of Davis and Kahan.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))

from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402
from real_shapes import DATA, require_data  # noqa: E402

import eigenshape as es  # noqa: E402

LION = DATA / "retrieval" / "lion"
NOISE = (0.01, 0.02, 0.05, 0.1)  # along normals, standard deviation in mean edge lengths
POSES = ("01", "03", "05", "07")
N_PAIRS, QUICK_PAIRS = 60, 12


def noisy(mesh: es.TriangleMesh, strength: float) -> es.TriangleMesh:
    """Move each vertex along its normal; the same draw at each strength."""
    draws = np.random.default_rng(0).standard_normal((mesh.n_vertices, 1))
    heights = strength * es.geometry.mean_side_length(mesh) * draws
    return es.TriangleMesh(
        mesh.vertices + heights * es.geometry.vertex_normals(mesh), mesh.faces
    )


def changed(quick: bool) -> dict[str, es.TriangleMesh]:
    """Return the lion with noise, and in other poses, in the size of its area."""
    rest = es.read_mesh(LION / "sumner_lion-reference.ply")
    strengths, poses = (NOISE[1:2], POSES[:1]) if quick else (NOISE, POSES)
    found = {f"noise {strength}": noisy(rest, strength) for strength in strengths}
    for pose in poses:
        found[f"pose {pose}"] = es.read_mesh(LION / f"sumner_lion-{pose}.ply")
    return found


def unit_area(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Scale a mesh to area 1."""
    return es.TriangleMesh(
        mesh.vertices / es.geometry.surface_area(mesh) ** 0.5, mesh.faces
    )


def row_of(found: es.spectral.EigenspaceAngles, values: np.ndarray) -> dict[str, float]:
    """Return what is printed of one shape."""
    degrees = np.degrees(found.angles)
    relative = found.gaps / values[found.starts]
    wide = relative > np.median(relative)
    order = np.argsort(np.argsort(found.gaps)), np.argsort(np.argsort(found.angles))
    return {
        "groups": len(degrees),
        "median": np.median(degrees),
        "first ten": degrees[:10].max(),
        "largest": degrees.max(),
        "median, wide gaps": np.median(degrees[wide]),
        "median, narrow gaps": np.median(degrees[~wide]),
        "rank correlation of angle and gap": np.corrcoef(*order)[0, 1],
        "% bounded below 90": 100 * np.mean(found.bounds < np.pi / 2),
        "largest angle over its bound": (found.angles / found.bounds).max(),
    }


def measure(quick: bool) -> tuple[dict[str, object], dict[str, es.spectral.EigenspaceAngles], np.ndarray]:
    """Return the rows of all shapes, the angles, and the eigenvalues of the lion at rest."""
    k = QUICK_PAIRS if quick else N_PAIRS
    rest = unit_area(es.read_mesh(LION / "sumner_lion-reference.ply"))
    laplacian = es.cotangent_laplacian(rest)
    one = es.solve_spectrum(laplacian, k + 1)
    rows, angles = {}, {}
    for name, mesh in track(changed(quick).items(), description="shapes"):
        two = es.solve_spectrum(es.cotangent_laplacian(unit_area(mesh)), k + 1)
        # The ratio makes groups small; constants are no group that can turn.
        found = es.spectral.eigenspace_angles(one, two, laplacian=laplacian, ratio=1.2)
        kept = found.starts > 0
        angles[name] = type(found)(
            *(getattr(found, part)[kept] for part in ("starts", "stops", "angles", "gaps", "bounds"))
        )
        rows[name] = row_of(angles[name], one.eigenvalues)
    return rows, angles, one.eigenvalues


def figure_gaps(angles: dict[str, es.spectral.EigenspaceAngles], values: np.ndarray) -> Figure:
    """Draw the angle of each group over the gap around it, noise on the left and poses on the right."""
    figure, panels = chart(10, 4.2, columns=2)
    for axes, kind in zip(panels, ("noise", "pose"), strict=True):
        chosen = {name: found for name, found in angles.items() if name.startswith(kind)}
        for (name, found), color in zip(chosen.items(), COLORS, strict=False):
            relative = found.gaps / values[found.starts]
            text = f"{name} edge lengths" if kind == "noise" else name
            axes.loglog(relative, np.degrees(found.angles), "o", ms=4, color=color, label=text)
        axes.set_ylim(0.05, 120)
        axes.axhline(90, color="#888888", lw=0.8)
        label(
            axes,
            "gap around the group / its eigenvalue",
            "largest angle in degrees" if kind == "noise" else "",
            f"{kind}: a group of eigenvectors a dot; lion, n = 5,000",
        )
    return figure


def main() -> None:
    """Measure, print, and draw."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    rows, angles, values = measure(arguments.quick)
    pictures = {} if arguments.quick else {"gaps": figure_gaps(angles, values)}
    finish(rounded(rows), pictures, arguments)


if __name__ == "__main__":
    main()
