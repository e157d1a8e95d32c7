"""Collections that are built, stopped, built further, and opened again."""

import numpy as np
import pytest
from specimens import make_specimen, mirror, move

import eigenshape as es


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
    (folder / "out" / "first" / "ball 1.npz").write_bytes(b"PK")
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


def test_too_few_specimens_are_refused(tmp_path):
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
    with pytest.raises(es.StoreError, match="A finished collection must be in the folder"):
        es.collections.open_collection(tmp_path)
    (tmp_path / "collection.json").write_text("{}")
    with pytest.raises(es.StoreError, match="files of a collection must be whole"):
        es.collections.open_collection(tmp_path)
    text = (built.folder / "collection.json").read_text().replace('"version": 2', '"version": 9')
    for kept in ("fits", "mean.ply"):
        (tmp_path / kept).symlink_to(built.folder / kept)
    (tmp_path / "collection.json").write_text(text)
    with pytest.raises(es.StoreError, match="The version of a collection must be 2"):
        es.collections.open_collection(tmp_path)
    with pytest.raises(es.InvalidParameterError, match="must be that of a specimen of the coll"):
        built.read_specimen("broken")


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
