"""Removing, compacting, exporting and merging; pictures; names of all kinds."""

import json
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from describers import RECIPE, descriptor, keep

import eigenshape as es
from eigenshape.retrieval import DescribedShape

NAMES = (
    "with spaces and 'quotes' \"double\"",
    "юникод 形状 🐈 e\u0301",
    "../../etc/passwd",
    "..",
    "/absolute",
    "C:\\windows\\path",
    "line\nbreak\ttab\rreturn\x1b[31m",
    "'; DROP TABLE shape; --",
    "<script>alert(1)</script>",
    4096 * "x",
)


@pytest.fixture
def index(tmp_path):
    return es.ShapeIndex.create(tmp_path / "index")


def fill(index, seeds, **facts):
    index.add_many(
        DescribedShape(f"s{seed}", [descriptor(seed)], digest=str(seed), **facts) for seed in seeds
    )


def found(index):
    return {
        record.name: index.query(descriptor(int(record.name[1:])))[0].name
        for record in index.records()
    }


def test_names_of_all_kinds_are_kept_and_are_never_paths(index, tmp_path):
    for number, name in enumerate(NAMES):
        shape = DescribedShape(
            name,
            [descriptor(number)],
            label=name,
            source=name,
            tags=[name],
            attributes={name: name},
            thumbnail=name.encode()[:100],
        )
        index.add_many([shape])
    assert [record.name for record in index.records()] == sorted(NAMES)
    for number, name in enumerate(NAMES):
        match = index.query(descriptor(number), n_matches=1, where={name: name, "tag": name})[0]
        assert (match.name, match.label, match.source) == (name, name, name)
        assert (index.thumbnail(name) or b"") == name.encode()[:100]
    index.export(tmp_path / "out")
    listing = json.loads((tmp_path / "out" / "records.json").read_text())
    assert [each["name"] for each in listing] == sorted(NAMES)
    other = es.ShapeIndex.create(tmp_path / "other")
    assert other.merge([index]) == len(NAMES)
    for name in NAMES:
        other.remove(name)
    assert len(other) == 0
    files = {"index.sqlite", "index.sqlite-reserve", "changes.txt"}
    assert {path.name for path in index.folder.iterdir()} == files
    assert {path.name for path in tmp_path.iterdir()} == {"index", "out", "other"}


def test_compact_gives_space_back(index):
    fill(index, range(20), thumbnail=b"picture")
    before = found(index)
    assert index.compact() == 0
    large = es.retrieval.HeatDescriptor(np.ones((9000, 3)), np.arange(9000), RECIPE)
    keep(index, "large", [large])
    size = (index.folder / "index.sqlite").stat().st_size
    index.remove("s3", "s4", "large")
    assert (index.folder / "index.sqlite").stat().st_size == size
    freed = index.compact()
    assert freed > 9000 * (3 * 4 + 8) - 20_000
    assert (index.folder / "index.sqlite").stat().st_size == size - freed
    assert found(index) == {name: name for name in before if name not in ("s3", "s4")}
    assert index.thumbnail("s5") == b"picture"
    assert index.verify().damages == ()
    fill(index, [3], thumbnail=b"new")
    assert index.thumbnail("s3") == b"new"
    index.remove(*(record.name for record in index.records()))
    index.compact()
    assert len(index) == 0
    fill(index, [1])
    assert found(index) == {"s1": "s1"}
    assert index.verify() == es.retrieval.IndexReport(1, 40, ())


def test_parts_merged_answer_as_one_build(tmp_path):
    whole = es.ShapeIndex.create(tmp_path / "whole")
    fill(whole, range(30), label="a", tags=["t"], thumbnail=b"p")
    parts = [es.ShapeIndex.create(tmp_path / f"part{number}") for number in range(3)]
    for number, part in enumerate(parts):
        fill(part, range(number, 30, 3), label="a", tags=["t"], thumbnail=b"p")
    merged = es.ShapeIndex.create(tmp_path / "merged")
    assert merged.merge(parts) == 30
    assert merged.merge(parts) == 0  # with the same digests
    twice = es.ShapeIndex.create(tmp_path / "twice")
    keep(twice, "x", [descriptor(0)])
    assert es.ShapeIndex.create(tmp_path / "once").merge([twice, twice]) == 1
    assert merged.records() == whole.records()
    for seed in range(0, 30, 7):
        one, other = (index.query(descriptor(seed), n_matches=30) for index in (merged, whole))
        assert [(match.name, match.score) for match in one] == [
            (match.name, match.score) for match in other
        ]
    assert merged.thumbnail("s4") == b"p"
    assert merged.verify() == whole.verify()
    merged.remove("s0")
    fill(merged, [100])
    merged.compact()
    assert found(merged) == {f"s{seed}": f"s{seed}" for seed in [*range(1, 30), 100]}


def test_what_cannot_be_merged(index, tmp_path):
    fill(index, range(3))
    with pytest.raises(es.StoreError, match=r"An index is merged with others; .* is this one"):
        index.merge([index])
    nameless = es.ShapeIndex.create(tmp_path / "nameless")
    keep(nameless, "s1", [descriptor(9)])
    with pytest.raises(es.StoreError, match=r"'s1' is in the index already\. Remove it first"):
        index.merge([nameless])
    other = es.ShapeIndex.create(tmp_path / "other")
    keep(other, "s1", [descriptor(9)], digest="else")
    with pytest.raises(
        es.StoreError, match=r"one shape; 's1' is in the index with digest 1, not e"
    ):
        index.merge([other])
    assert found(index) == {f"s{seed}": f"s{seed}" for seed in range(3)}
    assert index.merge([other], replace=True) == 1
    assert index.query(descriptor(9))[0].name == "s1"
    longer = es.ShapeIndex.create(tmp_path / "longer")
    rows = es.retrieval.HeatDescriptor(np.ones((2, 5)), np.arange(2), RECIPE)
    keep(longer, "x", [rows])
    with pytest.raises(
        es.InvalidParameterError, match="must have as many numbers; the features of"
    ):
        index.merge([longer])
    assert len(index) == 3


def test_merging_gives_a_shape_the_recipes_that_it_lacks(index, tmp_path):
    fill(index, [1])
    other = es.ShapeIndex.create(tmp_path / "other")
    fish = es.make_creature("fish", n_vertices=500)
    described = [descriptor(1), es.describe(fish, es.retrieval.SCALE_FREE)]
    keep(other, "s1", described, digest="1")
    assert index.merge([other]) == 0
    (record,) = index.records()
    assert record.recipes == (RECIPE, es.retrieval.SCALE_FREE)


def test_export_writes_what_numpy_and_json_read(index, tmp_path):
    fill(index, range(3), attributes={"height": 1.5}, tags=["t"])
    hand = es.make_creature("hand", n_vertices=500)
    index.add("hand", hand, n_views=0, recipe=es.retrieval.PatchRecipe())
    index.export(tmp_path / "all")
    listing = json.loads((tmp_path / "all" / "records.json").read_text())
    assert [each["name"] for each in listing] == ["hand", "s0", "s1", "s2"]
    assert listing[2]["attributes"] == {"height": 1.5}
    arrays = np.load(tmp_path / "all" / "descriptors.npz")
    assert np.array_equal(arrays["2/test/0/vectors"], descriptor(1).vectors.astype("<f4"))
    (patches,) = index.descriptors("hand", es.retrieval.PatchRecipe())
    name = listing[0]["recipes"][0]
    assert np.array_equal(arrays[f"0/{name}/0/codes"], patches.codes)
    assert np.array_equal(arrays[f"0/{name}/0/points/0/vertices"], patches.vertices)
    index.export(tmp_path / "one", ["s2"])
    assert len(np.load(tmp_path / "one" / "descriptors.npz").files) == 2
    with pytest.raises(es.StoreError, match="must be empty to export into; it is not"):
        index.export(tmp_path / "one")
    with pytest.raises(es.StoreError, match="must be in the index to be exported; 'x' is not"):
        index.export(tmp_path / "two", ["x"])
    for place in ("records.json", "records.json/below"):
        with pytest.raises(es.StoreError, match=r"An export needs a folder; .* cannot be made: "):
            index.export(tmp_path / "one" / place)


def test_all_that_is_known_of_a_shape_is_changed_and_nothing_else(index):
    fill(index, range(3))
    before = {record.name: record for record in index.records()}
    new = replace(
        before["s1"],
        label="cat",
        source="elsewhere.ply",
        digest="d",
        tags=("new",),
        attributes={"height": 2.0},
    )
    index.update([new])
    assert {record.name: record for record in index.records()} == before | {"s1": new}


def test_a_report_counts_the_bytes_of_numbers_and_pictures(tmp_path):
    counts = []
    for name, picture in (("without", None), ("with", b"picture")):
        index = es.ShapeIndex.create(tmp_path / name)
        fill(index, range(3), thumbnail=picture)
        report = index.verify()
        assert (report.n_shapes, report.damages) == (3, ())
        counts.append(report.n_bytes)
    assert counts[0] > 0
    assert counts[1] - counts[0] == 3 * len(b"picture")


def test_thumbnails_are_small_pictures_of_the_shape(index):
    index.add("hand", es.make_creature("hand", n_vertices=500), n_views=0)
    picture = index.thumbnail("hand")
    width, height, depth, kind = struct.unpack(">IIBB", picture[16:26])
    assert (width, height, depth, kind) == (128, 128, 8, 0)
    assert len(picture) <= 8192
    data = zlib.decompress(picture[picture.index(b"IDAT") + 4 : -16])
    rows = np.frombuffer(data, np.uint8).reshape(128, 129)
    pixels = np.cumsum(rows[:, 1:].astype(int), axis=0) % 256
    assert (pixels[0] == 255).all()
    assert 0.05 < (pixels < 240).mean() < 0.7
    keep(index, "without", [descriptor(1)])
    assert index.thumbnail("without") is None
    with pytest.raises(es.StoreError, match="must be in the index to have a picture; 'x' is not"):
        index.thumbnail("x")


def test_a_noisy_surface_fits_into_a_thumbnail():
    rng = np.random.default_rng(0)
    ball = es.icosphere(4)
    rough = es.TriangleMesh(
        ball.vertices + 0.05 * rng.standard_normal(ball.vertices.shape), ball.faces
    )
    assert len(es.retrieval.draw_thumbnail(rough)) <= 8192
