"""On which side a cortex lies."""

from importlib import resources
from pathlib import Path

import eigenshape as es
from eigenshape.io.hemispheres import hemisphere_of

CORTICES = Path(str(resources.files("neuromodes") / "data"))


def test_the_side_of_a_cortex_is_found():
    paths = sorted(CORTICES.glob("*midthickness.surf.gii"))
    assert len(paths) == 8
    for path in paths:
        assert hemisphere_of(es.read_mesh(path)) == ("left" if "hemi-L" in path.name else "right")
    assert hemisphere_of(es.icosphere(2)) == ""
