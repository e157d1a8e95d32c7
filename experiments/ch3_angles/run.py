"""How far do eigenspaces turn, and do gaps say how far? (thesis 3.5).

A lion that is stretched, with noise of four strengths, and in four poses, all with the same faces. The largest
principal angle of each group of eigenvectors is compared with the gap around its eigenvalues and with the bound of
Davis and Kahan.
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
STRETCHES = (0.001, 0.01, 0.1)  # of the longest side of its box, relative
NOISE = (0.01, 0.02, 0.05, 0.1)  # along normals, standard deviation in mean edge lengths
POSES = ("01", "03", "05", "07")
N_PAIRS, QUICK_PAIRS = 60, 12


def noisy(mesh: es.TriangleMesh, strength: float) -> es.TriangleMesh:
    """Move each vertex along its normal; the same draw at each strength."""
    draws = np.random.default_rng(0).standard_normal((mesh.n_vertices, 1))
    heights = strength * es.geometry.mean_side_length(mesh) * draws
    return es.TriangleMesh(mesh.vertices + heights * es.geometry.vertex_normals(mesh), mesh.faces)


def stretched(mesh: es.TriangleMesh, share: float) -> es.TriangleMesh:
    """Make the longest side of the box longer by a share."""
    factors = np.ones(3)
    factors[np.ptp(mesh.vertices, axis=0).argmax()] += share
    return es.TriangleMesh(mesh.vertices * factors, mesh.faces)


def changed(quick: bool) -> dict[str, es.TriangleMesh]:
    """Return the lion stretched, with noise, and in other poses."""
    rest = es.read_mesh(LION / "sumner_lion-reference.ply")
    strengths, poses = (NOISE[1:2], POSES[:1]) if quick else (NOISE, POSES)
    shares = STRETCHES[1:2] if quick else STRETCHES
    found = {f"stretch {share}": stretched(rest, share) for share in shares}
    found |= {f"noise {strength}": noisy(rest, strength) for strength in strengths}
    for pose in poses:
        found[f"pose {pose}"] = es.read_mesh(LION / f"sumner_lion-{pose}.ply")
    return found


def unit_area(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Scale a mesh to area 1."""
    return es.TriangleMesh(mesh.vertices / es.geometry.surface_area(mesh) ** 0.5, mesh.faces)


def row_of(found: es.spectral.EigenspaceAngles, values: np.ndarray) -> dict[str, float]:
    """Return what is printed of one shape."""
    degrees = np.degrees(found.angles)
    relative = found.gaps / values[found.starts]
    wide = relative > np.median(relative)
    ranks = np.argsort(np.argsort(relative)), np.argsort(np.argsort(found.angles))
    return {
        "groups": len(degrees),
        "median": np.median(degrees),
        "first ten": degrees[:10].max(),
        "largest": degrees.max(),
        "median, wide gaps": np.median(degrees[wide]),
        "median, narrow gaps": np.median(degrees[~wide]),
        "rank correlation with the gap": np.corrcoef(*ranks)[0, 1],
        "% bounded below 90": 100 * np.mean(found.bounds < np.pi / 2),
        "largest angle over its bound": (found.angles / found.bounds).max(),
    }


def measure(
    quick: bool,
) -> tuple[dict[str, object], dict[str, es.spectral.EigenspaceAngles], np.ndarray]:
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
            *(
                getattr(found, part)[kept]
                for part in ("starts", "stops", "angles", "gaps", "bounds")
            )
        )
        rows[name] = row_of(angles[name], one.eigenvalues)
    return rows, angles, one.eigenvalues


def figure_gaps(angles: dict[str, es.spectral.EigenspaceAngles], values: np.ndarray) -> Figure:
    """Draw the angle of each group over the gap around it, a panel for each kind of change."""
    figure, panels = chart(12, 4.2, columns=3)
    for axes, kind in zip(panels, ("stretch", "noise", "pose"), strict=True):
        chosen = {name: found for name, found in angles.items() if name.startswith(kind)}
        for (name, found), color in zip(chosen.items(), COLORS, strict=False):
            relative = found.gaps / values[found.starts]
            text = f"{name} edge lengths" if kind == "noise" else name
            axes.loglog(relative, np.degrees(found.angles), "o", ms=4, color=color, label=text)
        axes.set_ylim(0.002, 120)
        axes.axhline(90, color="#888888", lw=0.8)
        label(
            axes,
            "gap around the group / its eigenvalue",
            "largest angle in degrees" if kind == "stretch" else "",
            f"{kind}; a dot is a group of eigenvectors",
        )
        axes.legend(frameon=False, fontsize=8, loc="lower left")
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
