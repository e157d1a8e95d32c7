"""Indexes of older formats become indexes of this one; `format7.zip` and `format8.zip` were made by older versions."""

import sqlite3
from contextlib import closing
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from describers import RECIPE, descriptor
from search_cases import RECIPE as PATCHES
from search_cases import mixtures
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app
from eigenshape.retrieval.store.conversion import convert_index


@pytest.fixture(params=["format7.zip", "format8.zip"])
def old(request, tmp_path):
    with ZipFile(Path(__file__).with_name(request.param)) as file:
        file.extractall(tmp_path / "old")
    return tmp_path / "old"


def test_an_old_index_is_converted(old, tmp_path):
    with pytest.raises(
        es.StoreError, match=r"by an older version of eigenshape. Convert it: `eige"
    ):
        es.ShapeIndex.open(old)
    done = CliRunner().invoke(app, ["index", "convert", str(old), str(tmp_path / "new")])
    assert (done.exit_code, done.output.split(";")[0]) == (0, "3 shapes converted")
    index = es.ShapeIndex.open(tmp_path / "new")
    assert index.verify().damages == ()
    one, three, two = index.records()
    assert (one.name, one.label, one.source, one.digest) == ("one", "a", "/one.ply", "1")
    assert (one.tags, one.attributes, one.recipes) == (("t",), {"height": 1.5}, (RECIPE,))
    assert index.thumbnail("one") == b"picture"
    assert (two.recipes, three.recipes) == ((RECIPE, PATCHES), (PATCHES,))
    (match, _) = index.query(descriptor(2))
    assert (match.name, match.view, match.score) == ("one", 1, 0)
    for name, codes in zip(("two", "three"), mixtures(1, 2, 1), strict=True):
        (stored,) = index.descriptors(name, PATCHES)
        assert np.array_equal(stored.codes, codes)
        assert len(stored.vertices) == 5


def test_what_is_damaged_is_left_out(old, tmp_path):
    path = old / "details-1.bin"
    path.write_bytes(b"?" + path.read_bytes()[1:])
    with pytest.warns(es.retrieval.StoreWarning, match=r"shape 'one': 16 bytes of details-1\.bin"):
        assert convert_index(old, tmp_path / "new") == 2
    with pytest.raises(es.StoreError, match="must be empty to become an index"):
        convert_index(old, tmp_path / "new")


def test_only_old_indexes_are_converted(tmp_path):
    index = es.ShapeIndex.create(tmp_path / "index")
    with pytest.raises(es.StoreError, match=r"is of format 7 or 8; .* is of format 9"):
        convert_index(index.folder, tmp_path / "new")
    with closing(sqlite3.connect(index.folder / "index.sqlite")) as database:
        database.execute("PRAGMA application_id = 1")
    with pytest.raises(es.StoreError, match=r"is of format 7 or 8; .* is another program's"):
        convert_index(index.folder, tmp_path / "new")
    assert not (tmp_path / "new").exists()
