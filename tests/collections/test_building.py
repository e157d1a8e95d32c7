"""Collections that are built, stopped, built further, and opened again."""

import errno
import re
import shutil
import sqlite3
from contextlib import closing, contextmanager
from functools import cache

import numpy as np
import pytest
from specimens import make_specimen, mirror, move

import eigenshape as es
from eigenshape import _sealed
from eigenshape.collections import alignment, building, surface_fit
from eigenshape.collections.parts import read_fits


def spoil(folder, query):
    """Change the file of a collection behind the back of its checksums."""
    with closing(sqlite3.connect(folder / "collection.sqlite")) as database, database:
        database.execute(query)


@pytest.fixture(scope="module", autouse=True)
def few_turns():
    """Place specimens by few starts and steps, which are enough for these."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alignment, "N_TURNS", 4)
        patch.setattr(alignment, "FINE_REACH", np.geomspace(0.2, 0.05, 8))
        yield


@contextmanager
def rough_fits():
    """Make fits rough, for tests of how they are kept."""
    levels = tuple(level._replace(n_rounds=1, n_points=200) for level in surface_fit.LEVELS[:2])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surface_fit, "LEVELS", levels)
        patch.setattr(building, "SECOND_LEVELS", levels)
        patch.setattr(alignment, "N_POINTS", 120)
        patch.setattr(alignment, "N_ROUGH", 40)
        patch.setattr(surface_fit, "POSES_DIFFER", np.inf)
        patch.setattr(surface_fit, "STRAINED", np.inf)
        yield


@pytest.fixture
def quick():
    with rough_fits():
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    for number in range(2):
        es.write_mesh(make_specimen(number), folder / f"ball {number}.ply")
    es.write_mesh(move(mirror(make_specimen(2)), 1000.0), folder / "ball 2.ply")
    (folder / "broken.ply").write_text("ply\n")
    return folder


@pytest.fixture(scope="module")
def built(folder):
    return es.collections.build_collection(folder, folder / "out", template="ball 0")


def test_all_specimens_correspond_and_failures_are_named(built):
    assert built.names == ("ball 0", "ball 1", "ball 2")
    assert built.reflected == (False, False, True)
    assert built.failures.keys() == {"broken"}
    assert "ply" in built.failures["broken"]
    assert any("unit of length" in note for note in built.notes["ball 2"])
    assert any("mirror image" in note for note in built.notes["ball 2"])
    assert built.notes["ball 1"] == ()
    for number in range(2):
        away = np.linalg.norm(built.points[number] - make_specimen(number).vertices, axis=1)
        assert np.median(away) < 0.06
    truth = move(mirror(make_specimen(2)), 1000.0).vertices
    assert np.median(np.linalg.norm(built.points[2] - truth, axis=1)) < 60
    # Mirrored back, it differs from the others no more than they do.
    assert np.linalg.det(np.linalg.lstsq(
        built.unreflected[2] - built.unreflected[2].mean(axis=0),
        built.points[0] - built.points[0].mean(axis=0),
        rcond=None,
    )[0]) > 0  # fmt: skip


@pytest.mark.long
def test_a_separate_piece_is_noted_with_its_share(tmp_path):
    crumb, plate = es.icosphere(1), es.shapes.grid(3, 3)
    for number, radius in enumerate((0.03, 0.3)):
        pieces = (
            make_specimen(number),
            es.TriangleMesh(radius * crumb.vertices + [0, 3, 0], crumb.faces),
            es.TriangleMesh(radius * plate.vertices + [0, -3, 0], plate.faces),
        )
        joined = es.geometry.disjoint_union(*pieces)
        es.write_mesh(joined, tmp_path / f"ball {number}.ply")
    areas = np.array([es.geometry.surface_area(piece) for piece in pieces])
    sphere, sheet = (f"{share:.1%}" for share in (areas / areas.sum())[1:])
    built = es.collections.build_collection(tmp_path, tmp_path / "out")
    assert [note for note in built.notes["ball 0"] if "separate" in note] == []
    assert [note for note in built.notes["ball 1"] if "separate" in note] == [
        f"a separate piece has {sphere} of its area",
        f"a separate piece has {sheet} of its area",
    ]
    assert es.collections.open_collection(tmp_path / "out").notes == built.notes


def test_a_collection_is_opened_as_it_was_built(folder, built):
    opened = es.collections.open_collection(folder / "out")
    assert opened.names == built.names
    assert opened.notes == built.notes
    assert opened.failures == built.failures
    assert opened.reflected == built.reflected
    assert np.array_equal(opened.points, built.points)
    assert np.array_equal(opened.mean.vertices, built.mean.vertices)
    assert opened.read_specimen("ball 1").n_vertices == 642


def test_what_is_done_is_kept_and_what_is_damaged_is_done_again(folder, built, monkeypatch):
    from eigenshape.collections import building

    fitted = []
    fit = building.fit_surface

    def counted(source, target, **options):
        fitted.append(target)
        return fit(source, target, **options)

    monkeypatch.setattr(building, "fit_surface", counted)
    spoil(folder / "out", "UPDATE part SET data = x'00' WHERE kind = 'first' AND name = 'ball 1'")
    with pytest.raises(es.StoreError, match=r"of 6 rows of table part 5 do. Build it again in the"):
        es.collections.open_collection(folder / "out")
    steps = []
    # Without a template it keeps that of the folder, which has not the median area.
    again = es.collections.build_collection(
        folder, folder / "out", callback=lambda *step: steps.append(step)
    )
    assert again.template == "ball 0"
    assert len(fitted) == 1
    assert np.array_equal(again.points, built.points)
    assert steps[-1][:2] == (12, 12)
    assert [step[2] for step in steps if step[3]] == ["broken"]


def test_too_few_specimens_are_refused(tmp_path, quick):
    ball = make_specimen(0)
    with pytest.raises(es.InvalidParameterError, match="must have at least two specimens"):
        es.collections.build_collection({"one": ball}, tmp_path)
    with pytest.raises(es.InvalidParameterError, match="The template must be a specimen"):
        es.collections.build_collection({"one": ball, "two": ball}, tmp_path, template="three")
    flat = tmp_path / "flat.off"
    flat.write_text("OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n")
    scans = {"one": ball, "two": flat, "three": tmp_path / "none.ply"}
    with pytest.raises(es.InvalidShapeError, match="At least two specimens must be readable and"):
        es.collections.build_collection(scans, tmp_path)
    scans |= {"four": ball}
    with pytest.raises(es.InvalidShapeError, match="The template must be readable"):
        es.collections.build_collection(scans, tmp_path, template="three")


def test_what_is_no_collection_is_said(tmp_path, built):
    with pytest.raises(
        es.StoreError, match=r"A finished collection must be in the folder; .* is not"
    ):
        es.collections.open_collection(tmp_path)
    (tmp_path / "collection.json").write_text("{}")
    with pytest.raises(es.StoreError, match=r"of an earlier version .* Build it again in the same"):
        es.collections.open_collection(tmp_path)
    read_fits(tmp_path)
    with pytest.raises(es.StoreError, match=r"in the folder; the build in .* was stopped"):
        es.collections.open_collection(tmp_path)
    spoil(tmp_path, "PRAGMA user_version = 9")
    with pytest.raises(es.StoreError, match="must be a collection of format 1; it is of format 9"):
        es.collections.open_collection(tmp_path)
    with pytest.raises(es.InvalidParameterError, match="must be that of a specimen of the coll"):
        built.read_specimen("broken")


def test_a_specimen_is_placed_on_its_own_points_where_it_is(built):
    own = built.unreflected[built.number("ball 1")]
    placed = built.read_placed("ball 1", 2 * own + 1)
    surface = built.read_specimen("ball 1")
    assert not built.reflected[built.number("ball 1")]
    np.testing.assert_allclose(placed.vertices, 2 * surface.vertices + 1, atol=1e-9)
    with pytest.raises(es.InvalidShapeError, match=r"must hold one row for each of .*; it holds 3"):
        built.read_placed("ball 1", own[:3])


@pytest.fixture(scope="module")
def scans(folder):
    """The files of the folder, without the collection that it holds."""
    return {path.stem: path for path in folder.glob("*.ply")}


@pytest.fixture(scope="module")
def fresh_of(scans, tmp_path_factory):
    """Return a function that builds the collection of a template by rough fits, once."""

    @cache
    def build(template):
        with rough_fits():
            return es.collections.build_collection(
                scans, tmp_path_factory.mktemp("fresh"), template=template
            )

    return build


@pytest.fixture
def copy(built, tmp_path):
    """The folder of a copy of the collection."""
    return shutil.copytree(built.folder, tmp_path / "copy")


def same(one, other):
    """Return whether two collections hold the same numbers."""
    return np.array_equal(one.points, other.points) and np.array_equal(
        one.mean.vertices, other.mean.vertices
    )


class StoppedError(Exception):
    """Raised in the middle of a build, as Ctrl-C is."""


@pytest.mark.long
@pytest.mark.parametrize("step", [4, 7, 10, 11])
def test_a_stopped_build_with_another_template_leaves_the_last_collection(
    scans, built, copy, step, fresh_of, quick
):
    def stop(n_done, *_):
        if n_done == step:
            raise StoppedError

    with pytest.raises(StoppedError):
        es.collections.build_collection(scans, copy, template="ball 1", callback=stop)
    opened = es.collections.open_collection(copy)
    assert same(opened, built)
    assert (opened.template, opened.names) == (built.template, built.names)
    after_stop = es.collections.build_collection(scans, copy, template="ball 1")
    fresh = fresh_of("ball 1")
    assert same(after_stop, fresh)
    assert {path.name for path in copy.iterdir()} == {path.name for path in fresh.folder.iterdir()}


def test_a_surface_that_has_changed_is_not_taken_for_that_of_the_collection(tmp_path, quick):
    balls = {f"ball {i}": make_specimen(i) for i in range(2)}
    first = es.collections.build_collection(balls, tmp_path)
    again = es.collections.build_collection(balls | {"ball 1": make_specimen(7)}, tmp_path)
    assert not np.array_equal(first.points, again.points)
    assert len(list((tmp_path / "specimens").iterdir())) == 2
    for name in balls:
        assert again.read_specimen(name).n_vertices == 642
    es.write_mesh(make_specimen(3), again.sources[0])
    with pytest.raises(es.StoreError, match=r"must be the one that was fitted; .*has changed"):
        again.read_specimen("ball 0")


def test_a_file_that_changes_while_it_is_fitted_is_a_failure(scans, copy, quick):
    scans = scans | {"extra": shutil.copy(scans["ball 1"], copy.with_name("extra.ply"))}

    def change(n_done, n_steps, name, error):
        if n_done == 5:  # all are read
            es.write_mesh(make_specimen(5), scans["extra"])

    found = es.collections.build_collection(scans, copy, callback=change)
    assert "A file must not change while it is fitted" in found.failures["extra"]


@pytest.mark.long
def test_two_builds_at_once_are_both_right(scans, copy, fresh_of, quick):
    other = "ball 1"

    def build_other(n_done, *_):
        if n_done == 11:  # the first build has fits that the second one does not use
            es.collections.build_collection(scans, copy, template=other)

    first = es.collections.build_collection(scans, copy, template="ball 2", callback=build_other)
    fresh = fresh_of("ball 2")
    assert same(first, fresh)
    assert same(es.collections.open_collection(copy), fresh)
    names = ("mean.ply", "specimens.csv")
    assert all((copy / n).read_bytes() == (fresh.folder / n).read_bytes() for n in names)


@pytest.mark.parametrize("what", [b"", b"not a database", None])
def test_a_file_that_cannot_be_read_is_named_with_a_remedy(scans, copy, what, quick):
    path = copy / "collection.sqlite"
    path.write_bytes(path.read_bytes()[:70_000] if what is None else what)
    with pytest.raises(es.StoreError, match=r"[Bb]uild it again|Choose another folder") as said:
        es.collections.open_collection(copy)
    with pytest.raises(es.StoreError, match=re.escape(str(said.value)[:60])):
        es.collections.build_collection(scans, copy)


def test_what_is_lost_is_named_and_made_again(scans, tmp_path, quick):
    copy = tmp_path / "made"  # by rough fits alone: lost ones are made again by the same method
    built = es.collections.build_collection(scans, copy)
    (copy / "changes.txt").write_text("9999\n")
    with pytest.raises(es.StoreError, match=r"to be read; .* changes that were committed are lost"):
        es.collections.open_collection(copy)
    assert same(es.collections.build_collection(scans, copy), built)
    spoil(copy, "DELETE FROM part WHERE kind = 'last' AND name = 'ball 1'")
    with pytest.raises(es.StoreError, match=r"the fit of 'ball 1' is lost. Build it again"):
        es.collections.open_collection(copy)
    assert same(es.collections.build_collection(scans, copy), built)
    spoil(copy, "UPDATE seal SET n_rows = 'many' WHERE name = 'state'")
    with pytest.raises(es.StoreError, match="the seal of state differs"):
        es.collections.open_collection(copy)
    assert same(es.collections.build_collection(scans, copy), built)
    assert same(es.collections.open_collection(copy), built)


def test_a_full_disk_is_named_and_nothing_is_lost(scans, built, copy, quick, monkeypatch):
    connect = _sealed.connect

    def small(path, mode):
        database = connect(path, mode)
        (n_pages,) = database.execute("PRAGMA page_count").fetchone()
        database.execute(f"PRAGMA max_page_count = {n_pages}")
        return database

    with monkeypatch.context() as patch:
        patch.setattr(_sealed, "connect", small)
        with pytest.raises(es.StoreError, match=r"needs space on its disk; .* is full"):
            es.collections.build_collection(scans, copy, template="ball 1")
    assert same(es.collections.open_collection(copy), built)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("eigenshape.collections.collection.replace_file", full)
        with pytest.raises(es.StoreError, match=r"needs space on its disk; .*No space left"):
            es.collections.build_collection(scans, copy, template="ball 1")
    assert es.collections.open_collection(copy).template == "ball 1"


def test_what_killed_processes_leave_is_deleted_by_the_next_build(scans, copy, quick):
    left = [f".{'0a' * 8}.tmp", f"collection.sqlite.{'1b' * 8}.tmp-journal"]
    for name in (*left, "collection.sqlite.bak", ".mine.tmp"):
        (copy / name).touch()
    es.collections.build_collection(scans, copy)
    found = {path.name for path in copy.iterdir()}
    assert not found & set(left)
    assert found > {"collection.sqlite.bak", ".mine.tmp"}


def test_landmarks_are_carried_with_their_errors(built):
    chosen = [0, 1, 5, 100, 200, 300]
    names = [f"landmark {i}" for i in chosen]
    given = {
        f"ball {i}": es.morphometrics.Landmarks(names, make_specimen(i).vertices[chosen])
        for i in range(2)
    }
    carried = es.collections.carry_landmarks(built, given)
    truth = move(mirror(make_specimen(2)), 1000.0).vertices[chosen]
    away = np.linalg.norm(carried.points[2] - truth, axis=1)
    assert np.median(away) < 130  # a tenth of the radius
    assert (away < 4 * carried.spread[2]).all()
    assert np.array_equal(carried.points[0], given["ball 0"].points)
    assert not carried.spread[0].any()
    assert not carried.doubtful[2].any()


def test_curves_are_carried_and_spaced_evenly_on_each_surface(built):
    ball = make_specimen(0)
    order = np.argsort(ball.vertices[:, 0])
    ends = order[[0, -1]]
    path = es.calculus.geodesic_path(ball, *ends).points
    drawn = es.morphometrics.Landmarks(
        ["left", "right", *map(str, range(5))],
        np.concatenate([ball.vertices[ends], path[np.linspace(1, len(path) - 2, 5).astype(int)]]),
        curves=[[0, 2, 3, 4, 5, 6, 1]],
    )
    template = es.morphometrics.resample_curves(drawn, 9, mesh=ball)
    carried = es.collections.carry_landmarks(built, {"ball 0": template})
    assert carried.curves == template.curves == ((0, *range(2, 9), 1),)
    assert carried.names == template.names
    np.testing.assert_array_equal(carried.points[0], template.points)
    for name, own in carried.landmarks.items():
        surface = built.read_specimen(name)
        on = es.geometry.closest_points(surface, own.points).points
        size = np.ptp(surface.vertices)
        np.testing.assert_allclose(on, own.points, atol=1e-9 * size)
        steps = np.linalg.norm(np.diff(own.points[list(own.curves[0])], axis=0), axis=1)
        assert np.ptp(steps) < 0.05 * steps.mean()
    # Others may have the same points without curves; curves with other rows are refused.
    plain = es.morphometrics.Landmarks(template.names, carried.points[1])
    both = es.collections.carry_landmarks(built, {"ball 1": plain, "ball 0": template})
    assert both.curves == template.curves
    turned = es.morphometrics.Landmarks(
        template.names, carried.points[1], curves=[template.curves[0][::-1]]
    )
    with pytest.raises(es.InvalidParameterError, match="All curves of labelled must have the same"):
        es.collections.carry_landmarks(built, {"ball 1": turned, "ball 0": template})


def test_a_missing_landmark_is_carried_and_a_wrong_one_is_doubtful(built, tmp_path):
    chosen = [0, 1, 5, 100, 200, 300]
    names = [f"landmark {i}" for i in chosen]
    points = [make_specimen(i).vertices[chosen] for i in range(2)]
    points[0][3] = np.nan
    points[1][:2] = points[1][1::-1]  # exchanged by mistake
    given = {f"ball {i}": es.morphometrics.Landmarks(names, points[i]) for i in range(2)}
    carried = es.collections.carry_landmarks(built, given)
    assert np.linalg.norm(carried.points[0, 3] - make_specimen(0).vertices[100]) < 0.3
    assert carried.spread[0, 3] > 0
    # Of two labelled specimens nothing tells which one is wrong.
    assert carried.doubtful[:2].any(axis=0).tolist() == [True, True, False, False, False, False]
    carried.save(tmp_path / "landmarks.csv")
    rows = (tmp_path / "landmarks.csv").read_text().splitlines()
    header = "specimen,landmark,x,y,z,spread,doubtful,given,distance,disagreement,confidence"
    assert rows[0] == header
    assert len(rows) == 1 + 3 * len(chosen)
    row = next(row.split(",") for row in rows if row.startswith("ball 1,landmark 0,"))
    assert row[6:8] == ["1", "1"]
    assert float(row[9]) > 0.1  # from where ball 0 puts it
    # What is carried from doubtful ones alone is doubtful, too.
    assert carried.doubtful[2].tolist() == [True, True, False, False, False, False]


@pytest.fixture(scope="module")
def five(tmp_path_factory):
    folder = tmp_path_factory.mktemp("five")
    balls = {f"ball {i}": make_specimen(i) for i in range(5)}
    return es.collections.build_collection(balls, folder, template="ball 0")


CHOSEN = [0, 1, 5, 100, 200, 300, 400, 500]
BAD = {
    "labels in another order": lambda points, _: points[::-1],
    "another specimen": lambda points, number: make_specimen(number + 7).vertices[CHOSEN] * 1.03,
    "moved a little": lambda points, _: points + 0.05,
}


@pytest.mark.long
@pytest.mark.parametrize("what", BAD)
def test_of_two_bad_specimens_of_five_both_are_doubtful(what, five):
    names = [str(row) for row in CHOSEN]
    points = [make_specimen(i).vertices[CHOSEN] for i in range(5)]
    for number in (0, 3):
        points[number] = BAD[what](points[number], number)
    given = {f"ball {i}": es.morphometrics.Landmarks(names, points[i]) for i in range(5)}
    carried = es.collections.carry_landmarks(five, given)
    assert carried.doubtful[[0, 3]].mean() > 0.8
    assert carried.doubtful[[1, 2, 4]].mean() < 0.3
    assert carried.given.all()


@pytest.mark.long
def test_bad_landmarks_do_not_move_what_is_carried_from_others(five):
    names = [str(row) for row in CHOSEN]
    points = [make_specimen(i).vertices[CHOSEN] for i in range(3)]
    good = {f"ball {i}": es.morphometrics.Landmarks(names, points[i]) for i in (1, 2)}
    bad = {"ball 0": es.morphometrics.Landmarks(names, points[0][::-1])}
    with_bad = es.collections.carry_landmarks(five, good | bad)
    without = es.collections.carry_landmarks(five, good)
    np.testing.assert_allclose(with_bad.points[3:], without.points[3:], atol=1e-12)
    assert with_bad.doubtful[0].all()
    assert not with_bad.doubtful[3:].any()
    assert not with_bad.given[3:].any()
    assert np.isnan(with_bad.disagreement[3:]).all()
    assert (with_bad.disagreement[0] > 0.2).all()
    assert with_bad.distance[0].max() < 1e-12
    # From one specimen alone all are as doubtful as its own.
    beside = {"ball 0": es.morphometrics.Landmarks(names, points[0] + 0.05)}
    assert es.collections.carry_landmarks(five, beside).doubtful.all()


@pytest.mark.long
def test_landmarks_beside_their_surfaces_are_refused_with_every_specimen(five):
    names = [str(row) for row in CHOSEN]
    points = [make_specimen(i).vertices[CHOSEN] for i in range(3)]
    points[0], points[2] = points[0] / 1000, points[2] * [-1, -1, 1]
    given = {f"ball {i}": es.morphometrics.Landmarks(names, points[i]) for i in range(3)}
    with pytest.raises(
        es.InvalidParameterError, match=r"of 'ball 0' .* 1000 times .* of 'ball 2' .* as -x, -y, z"
    ):
        es.collections.carry_landmarks(five, given)


def test_landmarks_that_cannot_be_carried_are_refused(built):
    one = es.morphometrics.Landmarks(["a"], [[1.0, 0, 0]])
    none = es.morphometrics.Landmarks(["a"], [[np.nan] * 3])
    other = es.morphometrics.Landmarks(["b"], [[1.0, 0, 0]])
    for given, message in (
        ({}, "At least one specimen must have landmarks"),
        ({"ball 9": one}, "must be that of a specimen"),
        ({"ball 0": one, "ball 1": other}, "must have the same landmarks"),
        ({"ball 0": none}, "Each landmark must be given on one specimen"),
    ):
        with pytest.raises(es.InvalidParameterError, match=message):
            es.collections.carry_landmarks(built, given)
