"""A bit that flips in a file of an index changes no answer: each is as before, or a named error."""

import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from describers import descriptor

import eigenshape as es
from eigenshape.retrieval.store.writing import describe_to_store

HAND = es.make_creature("hand", 1, n_vertices=500)
KINDS = ("hand", "octopus")
PATCHES = es.retrieval.PatchRecipe()


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Return an index of two recipes whose database has inner pages, and in which something was replaced."""
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("sound") / "index")
    for seed in range(60):
        name, label = f"shape {seed} " + 20 * "n", f"class {seed % 3}"
        index.add_descriptors(
            name, [descriptor(seed)], label=label, source=f"/meshes/{seed}.ply", digest=64 * "d"
        )
    for kind in KINDS:
        mesh = es.make_creature(kind, 1, n_vertices=500)
        index.add(kind, mesh, recipe=PATCHES, n_views=0, label=kind)
    index.add_descriptors("hand", [descriptor(99)], digest="new", replace=True)
    index.add_descriptors("hand", describe_to_store(HAND, PATCHES, 0), digest="new")
    with closing(sqlite3.connect(index.folder / "index.sqlite")) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT * FROM shape").fetchone()
        index.remove(f"shape 7 {20 * 'n'}")  # stays in the log as long as somebody reads
        return shutil.copytree(index.folder, index.folder.with_name("with log"))


@pytest.fixture(scope="module")
def hand():
    return es.describe(HAND, PATCHES)


def answers(folder, hand):
    """Return what an index says to everything that one may ask it, in text."""
    index = es.ShapeIndex.open(folder)
    facts = [
        len(index),
        index.recipes(),
        index.records(),
        index.descriptors("octopus", PATCHES)[0].codes.tolist(),
    ]
    matches = index.query(descriptor(3), n_matches=100) + index.query(hand)
    found = [(vars(match) | {"vertices": match.vertices.tolist()}) for match in matches]
    return repr((facts, found))


def count_named(sound, hand, place, name, count):
    """Flip some random bits of a file one at a time, and return how many are named."""
    expected = answers(sound, hand)
    data = (sound / name).read_bytes()
    rng = np.random.default_rng(len(data))
    named = 0
    for bit in rng.integers(8 * len(data), size=count).tolist():
        folder = place / "index"
        shutil.copytree(sound, folder)
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        (folder / name).write_bytes(damaged)
        try:
            assert answers(folder, hand) == expected, f"bit {bit} of {name} changes an answer"
        except es.StoreError:
            named += 1
        shutil.rmtree(folder)
    return named


SHARED = "index.sqlite-shm"  # made anew by whoever opens the database first
FILES = ("index.sqlite", "index.sqlite-wal", SHARED, "committed.txt", "rows-1.bin", "rows-2.bin")


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_a_flipped_bit_changes_no_answer(sound, hand, tmp_path, name):
    named = count_named(sound, hand, tmp_path, name, 40)
    assert (named == 0) == (name == SHARED)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in FILES if name != SHARED])
def test_hundreds_of_flipped_bits_change_no_answer(sound, hand, tmp_path, name):
    assert count_named(sound, hand, tmp_path, name, 400) > 0


def test_every_file_of_an_index_is_tried(sound):
    assert {path.name for path in sound.iterdir() if path.stat().st_size} == set(FILES)
