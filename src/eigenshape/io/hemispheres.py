"""The hemisphere of a brain that the name of a file tells."""

import re
from typing import Literal

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh

# Share of the vertices of a hemisphere that lie on its side of x = 0. On eight cortices of humans,
# macaques and marmosets it is 0.987 or more, and 0.5 on spheres and inflated surfaces, which are
# centered.
ONE_SIDED = 0.9
# Names of files that name a hemisphere: lh.aparc.annot, sub-01_hemi-L.label.gii, S1.L.aparc.label.gii
SIDES = {
    side: re.compile(rf"^{hemisphere}\.|hemi-{letter}\b|hemi-{letter}_|[._]{letter}\.")
    for side, hemisphere, letter in (("left", "lh", "L"), ("right", "rh", "R"))
}


def hemisphere_of(mesh: TriangleMesh) -> Literal["left", "right", ""]:
    """Return the side on which a cortex lies, if it lies on one: x points to the right."""
    share = float((mesh.vertices[:, 0] < 0).mean())
    if share >= ONE_SIDED:
        return "left"
    return "right" if share <= 1 - ONE_SIDED else ""


def side_of_file(mesh: TriangleMesh, name: str, structure: str = "") -> str:
    """Return the hemisphere that a file of a surface names, "left", "right" or neither.

    Raise FileFormatError if the surface lies on the other side.
    """
    found = hemisphere_of(mesh)
    for side, pattern in SIDES.items():
        if side in structure.lower() if structure else pattern.search(name):
            if found not in (side, ""):
                raise FileFormatError(
                    f"A file must be of the hemisphere of the surface; it is of the {side} one "
                    f"({structure or name}), and the surface lies on the {found}, x "
                    f"{'<' if found == 'left' else '>'} 0."
                )
            return side
    return ""
