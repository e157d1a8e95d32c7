"""Short rows: what they tell of distances, and the file that holds them."""

import numpy as np
import pytest
from search_cases import RECIPE, make_source, mixtures

from eigenshape.retrieval.patches.distance import patch_distances
from eigenshape.retrieval.search import coarse
from eigenshape.retrieval.search.axes import fit_axes
from eigenshape.retrieval.search.coarse import coarse_rows


def test_a_scan_nearly_returns_the_distances(tmp_path):
    source = make_source(tmp_path, 300)
    found = coarse_rows(source, RECIPE)
    assert found.numbers.shape == (300, 3, 2 * 64)  # as many axes as a code has numbers
    for query in mixtures(2, 5)[:, 0]:
        exact = patch_distances(query, source.codes[:, 0])
        assert found.scores(query) == pytest.approx(exact, abs=0.02)


def test_fewer_axes_keep_the_order_of_the_nearest(tmp_path, monkeypatch):
    monkeypatch.setattr("eigenshape.retrieval.search.axes.N_AXES", 40)
    source = make_source(tmp_path, 300)
    found = coarse_rows(source, RECIPE)
    assert found.numbers.shape == (300, 3, 2 * 40)
    for query in mixtures(2, 5)[:, 0]:
        nearest = patch_distances(query, source.codes[:, 0]).argmin()
        assert nearest in np.argsort(found.scores(query))[:10]


def test_codes_of_zeros_have_no_direction():
    codes = mixtures(3, 4)[:, 0]
    codes[1] = 0
    axes = fit_axes(codes)
    rows = axes.coarse_rows(codes)
    assert not rows[1].any()
    query, unit = axes.coarse_query(codes[1])
    assert not query.any()
    assert np.isfinite(unit)


def test_rows_are_read_again_and_completed(tmp_path, monkeypatch):
    source = make_source(tmp_path, 40)
    first = coarse_rows(source.chosen(range(30)), RECIPE)
    assert len(list(tmp_path.iterdir())) == 1

    made = []
    monkeypatch.setattr(
        coarse,
        "_codes",
        lambda *some, codes=coarse._codes: made.append(len(some[2])) or codes(*some),
    )
    again = coarse_rows(source.chosen(range(30)), RECIPE)
    assert np.array_equal(again.numbers, first.numbers)
    assert made == []

    changed = source.chosen([35, *range(2, 25), 39])  # some were added, others removed
    now = coarse_rows(changed, RECIPE)
    assert made == [2]
    assert np.array_equal(now.numbers[1:-1], first.numbers[2:25])
    assert np.array_equal(now.axes.axes, first.axes.axes)
    assert now.checksums.tolist() == changed.row_checksums.tolist()
    assert not now.numbers.flags.writeable


def test_few_changes_leave_the_file_as_it_is(tmp_path):
    source = make_source(tmp_path, 200)
    first = coarse_rows(source.chosen(range(190)), RECIPE)
    (path,) = tmp_path.iterdir()
    written = path.read_bytes()
    places = [*range(3), 195, 193, *range(3, 8), *range(10, 190)]  # two new, two removed
    changed = source.chosen(places)
    for before in (None, first):
        now = coarse_rows(changed, RECIPE, before)
        assert path.read_bytes() == written
        assert (len(now.numbers), len(now.added), len(now.rows)) == (190, 2, 190)
        assert now.checksums[now.rows].tolist() == changed.row_checksums.tolist()
        for query in mixtures(2, 3)[:, 0]:
            expected = patch_distances(query, changed.codes[:, 0])
            assert now.scores(query) == pytest.approx(expected, abs=0.02)
            some = np.array([0, 3, 4, 100])
            assert now.scores_at(query, some).tolist() == now.scores(query)[some].tolist()
    assert now.numbers is first.numbers
    later = coarse_rows(source, RECIPE, now)  # all ten are there again, and eight of them are new
    assert (len(later.numbers), len(later.added)) == (190, 10)
    most = coarse_rows(source.chosen(range(170)), RECIPE, later)
    assert path.read_bytes() != written
    assert (len(most.numbers), len(most.added)) == (170, 0)


def test_axes_are_fitted_again_when_an_index_has_grown(tmp_path):
    source = make_source(tmp_path, 60)
    few = coarse_rows(source.chosen(range(10)), RECIPE)
    some, all_of_them = (coarse_rows(source.chosen(range(count)), RECIPE) for count in (40, 41))
    assert (few.n_fitted, some.n_fitted, all_of_them.n_fitted) == (10, 10, 41)


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "other", "longer"])
def test_a_damaged_file_is_made_again(tmp_path, damage):
    source = make_source(tmp_path, 30)
    expected = np.array(coarse_rows(source, RECIPE).numbers)
    (path,) = tmp_path.iterdir()
    data = bytearray(path.read_bytes())
    if damage == "flipped":
        data[-5] ^= 64
    spoilt = {"cut": data[:-1], "empty": b"", "other": b"PK\x03\x04", "longer": data + b"\0"}
    path.write_bytes(spoilt.get(damage, data))
    assert np.array_equal(coarse_rows(source, RECIPE).numbers, expected)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_a_folder_that_cannot_be_written_to_is_searched(tmp_path):
    source = make_source(tmp_path / "missing", 30)
    assert coarse_rows(source, RECIPE).numbers.shape == (30, 3, 2 * 64)
