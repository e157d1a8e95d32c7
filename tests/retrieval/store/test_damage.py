"""What is damaged is named and left out, and the rest is answered as before: flipped bits and torn files."""

import shutil
import sqlite3
import warnings
from contextlib import closing, contextmanager

import numpy as np
import pytest
from describers import RECIPE, descriptor, keep

import eigenshape as es
from eigenshape.retrieval import DescribedShape
from eigenshape.retrieval.description import describe_to_store

PATCHES = es.retrieval.PatchRecipe()
SHARED = "index.sqlite-shm"  # made anew by whoever opens the database first
FILES = (
    "index.sqlite",
    "index.sqlite-wal",
    SHARED,
    "committed.txt",
    "rows-1.bin",
    "details-1.bin",
    "rows-2.bin",
    "details-2.bin",
    "thumbnails.bin",
)
LOST = "changes that were committed are lost"


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Return an index of two recipes whose database has inner pages, with changes in its log."""
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("sound") / "index")
    hand = es.make_creature("hand", 1, n_vertices=500)
    picture = es.retrieval.draw_thumbnail(hand)
    index.add_many(
        DescribedShape(
            f"shape {seed} " + 20 * "n",
            [descriptor(seed)],
            label=f"class {seed % 3}",
            source=f"/meshes/{seed}.ply",
            digest=64 * "d",
            attributes={"seed": seed},
            thumbnail=picture,
        )
        for seed in range(40)
    )
    keep(index, "hand", describe_to_store(hand, PATCHES, 0), label="hand")
    with closing(sqlite3.connect(index.folder / "index.sqlite")) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT * FROM shape").fetchone()
        keep(index, "late", [descriptor(99)])
        index.remove(f"shape 7 {20 * 'n'}")  # stays in the log as long as somebody reads
        return shutil.copytree(index.folder, index.folder.with_name("with log"))


def answers(folder):
    """Return by name what an index says of each shape: its record, match, codes and picture."""
    index = es.ShapeIndex.open(folder)
    found = {record.name: [repr(vars(record))] for record in index.records()}
    for match in index.query(descriptor(3), n_matches=100):
        facts = vars(match) | {"correspondences": match.correspondences.tolist()}
        found[match.name].append(repr(facts | {"vertices": match.vertices.tolist()}))
    third = f"shape 3 {20 * 'n'}"
    with named_damage():
        (codes,) = index.descriptors("hand", PATCHES)
        found["hand"].append(codes.codes.tobytes() + repr(codes.points[0].vertices).encode())
    with named_damage():
        found[third].append(index.thumbnail(third))
    return found


@contextmanager
def named_damage():
    """Take an error about one shape as a warning: what is asked of the others is answered."""
    try:
        yield
    except es.StoreError as err:
        warnings.warn(str(err), es.retrieval.StoreWarning, stacklevel=1)


def outcome(folder):
    """Return the answers, or None; and what was said about damage."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = answers(folder)
        except es.StoreError as err:
            return None, str(err)
    assert all(issubclass(each.category, es.retrieval.StoreWarning) for each in caught)
    return found, "; ".join(str(each.message) for each in caught)


@pytest.fixture(scope="module")
def expected(sound, tmp_path_factory):
    folder = shutil.copytree(sound, tmp_path_factory.mktemp("expected") / "index")
    found, said = outcome(folder)
    assert said == ""
    assert len(found) == 41
    return found


def check_damaged(sound, expected, folder, name, data, where):
    """Ask an index with one damaged file; return the share that is served, or None if nothing is wrong."""
    shutil.copytree(sound, folder)
    (folder / name).write_bytes(data)
    found, said = outcome(folder)
    all_damage = "" if found in (None, expected) else damage_of(folder)
    shutil.rmtree(folder)
    if found == expected and not said:
        return None
    assert said, f"{where} of {name} changes an answer, and nothing is named"
    if found is None:
        return 0.0
    if LOST in said:  # then the state before those changes is served
        return 1.0
    served = 0
    for shape, facts in found.items():
        for fact in facts:
            right = fact in expected[shape] or f"shape {shape!r}" in all_damage
            assert right, f"{where} of {name} changes an answer for {shape}"
        served += len(facts) == len(expected[shape])
    return served / len(expected)


def damage_of(folder):
    return "\n".join(map(str, es.ShapeIndex(folder).verify().damages))


def flip(data, bit):
    damaged = bytearray(data)
    damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def count_flips(sound, expected, place, name, count):
    """Flip random bits of a file one at a time; return the shares that are served of the damaged ones."""
    data = (sound / name).read_bytes()
    rng = np.random.default_rng(len(name))
    shares = [
        check_damaged(sound, expected, place / "index", name, flip(data, bit), f"bit {bit}")
        for bit in rng.integers(8 * len(data), size=count).tolist()
    ]
    return [share for share in shares if share is not None]


@pytest.mark.parametrize("name", FILES)
def test_a_flipped_bit_is_named_and_the_rest_is_served(sound, expected, tmp_path, name):
    shares = count_flips(sound, expected, tmp_path, name, 8)
    assert (len(shares) == 0) == (name == SHARED)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in FILES if name != SHARED])
def test_a_thousand_flipped_bits_are_named_and_the_rest_is_served(sound, expected, tmp_path, name):
    count = 300 if name == "index.sqlite" else 100
    shares = count_flips(sound, expected, tmp_path, name, count)
    assert shares
    if name not in ("index.sqlite", "index.sqlite-wal"):
        # Of a file of numbers one shape is lost at most, or a query by the one recipe is refused.
        assert np.mean(shares) > 0.5


@pytest.mark.parametrize("name", [name for name in FILES if name not in (SHARED, "committed.txt")])
def test_a_torn_file_is_named_and_the_rest_is_served(sound, expected, tmp_path, name):
    data = (sound / name).read_bytes()
    for length in np.linspace(0, len(data) - 1, 6).astype(int).tolist():
        args = (sound, expected, tmp_path / "index", name, data[:length], f"end at {length}")
        share = check_damaged(*args)
        # The last pages of the database may be in its log already, or empty
        assert share is not None or name == "index.sqlite"


def test_verify_names_shape_file_and_bytes(sound, tmp_path):
    folder = shutil.copytree(sound, tmp_path / "index")
    index = es.ShapeIndex.open(folder)
    assert index.verify().damages == ()
    for name in ("rows-1.bin", "details-1.bin", "thumbnails.bin"):
        path = folder / name
        path.write_bytes(flip(path.read_bytes(), 8))
    damages = index.verify().damages
    assert {(damage.file, damage.shape) for damage in damages} == {
        ("rows-1.bin", f"shape 0 {20 * 'n'}"),
        ("details-1.bin", f"shape 0 {20 * 'n'}"),
        ("thumbnails.bin", f"shape 0 {20 * 'n'}"),
    }
    assert all(damage.start == 0 < damage.end for damage in damages)
    with pytest.raises(es.StoreError, match="An index must be whole to be compacted; "):
        index.compact()
    rest = es.ShapeIndex.create(tmp_path / "rest")
    with pytest.warns(es.retrieval.StoreWarning, match="differ"):
        assert rest.merge([index]) == 40
    assert rest.verify().damages == ()


def test_a_damaged_row_of_the_catalog_is_named(sound, tmp_path):
    folder = shutil.copytree(sound, tmp_path / "index")
    with closing(sqlite3.connect(folder / "index.sqlite")) as database, database:
        database.execute("UPDATE shape SET label = 'other' WHERE id = 5")
        database.execute("UPDATE descriptor SET rows_offset = 0 WHERE id = 9")
        database.execute("DELETE FROM shape WHERE id = 12")
    index = es.ShapeIndex.open(folder)
    with pytest.warns(es.retrieval.StoreWarning, match="row 5 of table shape differs") as said:
        names = {record.name for record in index.records()}
    assert f"shape 8 {20 * 'n'}" in {damage.shape for damage in index.verify().damages}
    assert names.isdisjoint({f"shape {number} {20 * 'n'}" for number in (4, 11)})
    assert "and 3 more" in str(said[0].message)
    with closing(sqlite3.connect(folder / "index.sqlite")) as database, database:
        database.execute("UPDATE seal SET total = 0 WHERE id = 'shape'")
    with pytest.raises(
        es.StoreError, match="must hold what was written; the seal of shape differs"
    ):
        index.records()
    with closing(sqlite3.connect(folder / "index.sqlite")) as database, database:
        database.execute("UPDATE recipe SET fields = '{}' WHERE id = 1")
        database.execute("DELETE FROM seal WHERE id = 'shape'")
    with pytest.raises(es.StoreError, match="the seal of shape differs"):
        keep(index, "new", [descriptor(1)])


def test_a_damaged_recipe_is_named(sound, tmp_path):
    folder = shutil.copytree(sound, tmp_path / "index")
    with closing(sqlite3.connect(folder / "index.sqlite")) as database, database:
        database.execute("UPDATE codebook SET data = x'00' WHERE id = 2")
    index = es.ShapeIndex.open(folder)
    with pytest.warns(es.retrieval.StoreWarning, match="the codebook of recipe 2 differs"):
        assert index.query(descriptor(3), n_matches=1)[0].score == 0
    with pytest.raises(es.StoreError, match="An index must be whole to be changed; "):
        keep(index, "new", [descriptor(1)])


def described_again(seed):
    name = f"shape {seed} {20 * 'n'}"
    return DescribedShape(name, [descriptor(seed)], digest=64 * "d", thumbnail=b"picture")


@pytest.mark.parametrize("name", ["rows-1.bin", "details-1.bin", "thumbnails.bin"])
def test_a_damaged_shape_that_is_added_again_is_written_anew(sound, tmp_path, name):
    index = es.ShapeIndex(shutil.copytree(sound, tmp_path / "index"))
    path = index.folder / name
    path.write_bytes(flip(path.read_bytes(), 8))
    assert len(index.verify().damages) == 1
    index.add_many([described_again(1)])
    assert len(index.verify().damages) == 1, "a whole shape of the same digest is kept as it is"
    index.add_many([described_again(0), described_again(0)])
    assert index.verify().damages == ()
    assert (len(index), index.query(descriptor(0), n_matches=1)[0].score) == (41, 0)
    assert index.thumbnail(described_again(1).name) != b"picture"
    assert index.thumbnail(described_again(0).name) == b"picture"


def test_a_torn_file_and_damaged_rows_of_the_catalog_are_mended_too(sound, tmp_path):
    index = es.ShapeIndex(shutil.copytree(sound, tmp_path / "index"))
    path = index.folder / "rows-1.bin"
    path.write_bytes(path.read_bytes()[:-8])
    with closing(sqlite3.connect(index.folder / "index.sqlite")) as database, database:
        database.execute("UPDATE shape SET label = 'other' WHERE id = 5")
        database.execute("UPDATE descriptor SET rows_offset = 0 WHERE id = 9")
    named = {damage.shape for damage in index.verify().damages}
    assert named >= {described_again(4).name, described_again(8).name, "late"}
    part = es.ShapeIndex.create(tmp_path / "part")
    part.add_many([described_again(4), described_again(8)])
    assert index.merge([part]) == 2
    assert [damage.shape for damage in index.verify().damages] == ["late"]
    keep(index, "late", [descriptor(99)], digest="new", replace=True)
    assert index.verify().damages == ()
    assert index.query(descriptor(99), n_matches=1)[0].name == "late"


def test_every_file_of_an_index_is_tried(sound):
    assert {path.name for path in sound.iterdir() if path.stat().st_size} == set(FILES)
    assert descriptor(3).recipe == RECIPE
