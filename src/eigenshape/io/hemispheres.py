"""The hemisphere of a brain that the name of a file tells."""

import re

from certeig.kit.errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.masks import hemisphere_of

# Names of files that name a hemisphere: lh.aparc.annot, sub-01_hemi-L.label.gii, S1.L.aparc.label.gii
SIDES = {
    side: re.compile(rf"^{hemisphere}\.|hemi-{letter}\b|hemi-{letter}_|[._]{letter}\.")
    for side, hemisphere, letter in (("left", "lh", "L"), ("right", "rh", "R"))
}


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
