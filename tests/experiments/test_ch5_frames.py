"""The figures on frames of a depth camera: the README shows what was found."""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval"
sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]

import frames  # noqa: E402


def test_descriptors_without_frames_are_those_of_today():
    import eigenshape as es

    fish = es.make_creature("fish", n_vertices=500)
    patches = es.retrieval.extract_patches(fish, n_frames=1)
    found = es.retrieval.patch_descriptor(patches, es.retrieval.PatchRecipe())
    today = es.describe(fish)
    assert len(found.codes) == len(today.codes) + 1
    assert (frames.without_frames(found).codes == today.codes).all()
