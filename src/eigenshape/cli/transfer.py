"""eigenshape transfer: what a character wears, on another one."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, print_written, progress_bar


def transfer(
    source: Path,
    target: Path,
    *,
    output: Path,
    landmarks: Path | None = None,
    repair: str = "auto",
    as_json: bool = False,
) -> None:
    """Transfer texture, skin, blend shapes, colors and fields of a character to another one.

    What corresponds is found by itself. The written file also holds, as `_CONFIDENCE`, how sure each
    vertex is; regions in doubt are filled from around, and named.

    For instance: eigenshape transfer hero.glb scan.ply -o rigged.glb

    Parameters
    ----------
    source
        File of the character with texture, skin or the like: GLB, OBJ, PLY and others.
    target
        Mesh file of the other character, in its rest pose.
    output
        Write the target with all that was transferred (GLB).
    landmarks
        Points on the source, in a file of landmarks. Those on the target are written beside the output, with
        the ending .landmarks.csv.
    """
    steps.require_output(output, (".glb",), "What was transferred")
    mesh, worn = es.read_mesh(source, attributes=True)
    other = steps.load_surface(target, repair)
    ready = steps.repair_worn(mesh, worn, repair)
    points = None if landmarks is None else es.morphometrics.read_landmarks(landmarks)
    with progress_bar("transfer") as progress:
        outfit = es.matching.transfer(ready, other, landmarks=points, progress=progress)
    es.write_mesh(other, output, attributes=outfit.attributes)
    print_written(output)
    if outfit.landmarks is not None:
        path = output.with_suffix(".landmarks.csv")
        es.morphometrics.write_landmarks(outfit.landmarks, path)
        print_written(path)
    carried = [kind for kind, is_there in ready.contents.items() if is_there]
    carried.extend(ready.others)
    if as_json:
        print_json(
            {
                "output": output,
                "carried": carried,
                "mean_confidence": outfit.confidence.mean(),
                "share_filled": outfit.filled.mean(),
                "vertex_confidence": outfit.confidence,
                "report": outfit.report,
            }
        )
        return
    out.print(
        f"transferred {', '.join(carried)} to {other.n_vertices:,} vertices; the mean confidence is "
        f"{outfit.confidence.mean():.2f}"
    )
    for sentence in outfit.report:
        out.print(f"{sentence}.")
