"""Landmarks come back from each format as they were, and a damaged file is refused or rightly read."""

import json

import numpy as np
import pytest

import eigenshape as es
from eigenshape.morphometrics.landmark_files import FORMATS, OF_ONE

NAMES = ("nasion", "left, upper", "rand", "x", "y")
CURVES = ((0, 3, 4), (1, 2, 4, 1))


def some_points(seed=0):
    points = np.random.default_rng(seed).standard_normal((5, 3)) * [1e-7, 1, 1e8]
    points[2] = np.nan
    return points


def specimen(seed=0):
    spread = [0.1, 0.25, np.nan, 1 / 3, 2.0]
    return es.morphometrics.Landmarks(NAMES, some_points(seed), spread, CURVES)


def kept(landmarks, suffix):
    """Return what a format keeps of landmarks."""
    numbered = tuple(str(number + 1) for number in range(len(landmarks.names)))
    return es.morphometrics.Landmarks(
        numbered if suffix in (".tps", ".txt") else landmarks.names,
        landmarks.points,
        landmarks.spread if suffix == ".csv" else None,
        landmarks.curves if suffix == ".mrk.json" else (),
    )


def same(one, two):
    arrays = [(one.points, two.points)]
    if (one.spread is None) != (two.spread is None):
        return False
    if one.spread is not None:
        arrays.append((one.spread, two.spread))
    exact = all(np.array_equal(*pair, equal_nan=True) for pair in arrays)
    return exact and one.names == two.names and one.curves == two.curves


@pytest.mark.parametrize("suffix", FORMATS)
def test_landmarks_come_back_to_the_last_bit(suffix, tmp_path):
    path = tmp_path / f"A skull{suffix}"
    es.morphometrics.write_landmarks(specimen(), path)
    assert same(es.morphometrics.read_landmarks(path), kept(specimen(), suffix))
    assert list(es.morphometrics.read_specimens(path)) == ["A skull"]


@pytest.mark.parametrize("suffix", [each for each in FORMATS if each not in OF_ONE])
def test_several_specimens_come_back_in_their_order(suffix, tmp_path):
    path = tmp_path / f"all{suffix.upper()}"
    given = {"b = 1": specimen(1), "a": specimen(2), 'c "x", y': specimen(3)}
    es.morphometrics.write_landmarks(given, path)
    found = es.morphometrics.read_specimens(path)
    assert list(found) == list(given)
    assert all(same(found[name], kept(given[name], suffix)) for name in given)
    with pytest.raises(es.FileFormatError, match="must hold one specimen; it holds 3"):
        es.morphometrics.read_landmarks(path)


@pytest.mark.parametrize("suffix", OF_ONE)
def test_slicer_has_one_file_for_each_specimen(suffix, tmp_path):
    with pytest.raises(es.InvalidParameterError, match="holds one specimen; there are 2"):
        es.morphometrics.write_landmarks(
            {"a": specimen(), "b": specimen()}, tmp_path / f"a{suffix}"
        )


def test_names_that_would_read_as_something_else_are_refused(tmp_path):
    with pytest.raises(es.InvalidParameterError, match="The name of a specimen must be a text"):
        es.morphometrics.write_landmarks({" a": specimen()}, tmp_path / "a.csv")
    with pytest.raises(
        es.InvalidParameterError, match=r"must not begin with \[, as sections do; '\[a' does"
    ):
        es.morphometrics.write_landmarks({"[a": specimen()}, tmp_path / "a.txt")
    assert not list(tmp_path.iterdir())


def test_points_of_the_system_ras_are_turned_to_lps(tmp_path):
    path = tmp_path / "a.mrk.json"
    point, lost = {"id": "7", "position": [1.0, 2.0, 3.0]}, {"positionStatus": "undefined"}
    markup = {"coordinateSystem": "RAS", "controlPoints": [point, lost]}
    path.write_text(json.dumps({"markups": [markup]}))
    found = es.morphometrics.read_landmarks(path)
    assert found.names == ("7", "2")
    np.testing.assert_array_equal(found.points, [[-1.0, -2.0, 3.0], [np.nan] * 3])
    for system, sign in (("0", -1), ("RAS", -1), ("1", 1), ("LPS", 1)):
        path = tmp_path / f"{system}.fcsv"
        path.write_text(
            f"# CoordinateSystem = {system}\nF1,1,2,3,0,0,0,1,1,1,0,nose,,\n\nF2,4,5,6,0,0,0,1,1,1,0,,,\n"
        )
        found = es.morphometrics.read_landmarks(path)
        assert found.names == ("nose", "2")
        assert found.points.tolist() == [[sign * 1, sign * 2, 3], [sign * 4, sign * 5, 6]]


def test_a_curve_of_slicer_alone_makes_its_points_landmarks(tmp_path):
    path = tmp_path / "a.mrk.json"
    points = [{"label": f"C-{i}", "position": [i, 0, 0]} for i in range(3)]
    path.write_text(json.dumps({"markups": [{"type": "ClosedCurve", "controlPoints": points}]}))
    found = es.morphometrics.read_landmarks(path)
    assert found.names == ("C-0", "C-1", "C-2")
    assert found.curves == ((0, 1, 2, 0),)


def test_files_of_other_programs_are_read(tmp_path):
    path = tmp_path / "a.tps"
    path.write_bytes(b"LM3=2\r\n1\t2 3\r\n4 5 6\r\nIMAGE=a.jpg\r\nSCALE=0.5\r\n")
    found = es.morphometrics.read_specimens(path)
    assert found["a.jpg"].points.tolist() == [[0.5, 1, 1.5], [2, 2.5, 3]]
    path = tmp_path / "a.txt"
    path.write_text(
        "[Individuals]\n2\n[landmarks]\n1\n[Dimensions]\n3\n[labels]\nsex\n[labelvalues]\nm\nf\n"
        "[rawpoints]\n'one\n1 2 3\n'two\n4 5 6 \n[wireframe]\n1 1\n"
    )
    found = es.morphometrics.read_specimens(path)
    assert found["2"].points.tolist() == [[4.0, 5.0, 6.0]]
    path = tmp_path / "a.csv"
    path.write_text('"x","y","z","landmark","specimen"\n1,2,3,"nose",A\n,NA,nan,ear,A\n')
    found = es.morphometrics.read_landmarks(path)
    assert found.names == ("nose", "ear")
    assert found.spread is None
    assert np.isnan(found.points[1]).all()


WRONG = {
    "a.ply": ("", "Files of landmarks end in"),
    "a.csv": ("specimen,landmark,x,y\n", "z is missing"),
    "b.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\nb,m,1,2,3\n", "same landmarks in the same order.*'b' has 'm'"),
    "c.csv": ("specimen,landmark,x,y,z\na,n,1,2\n", "as many cells as the first; one is .'a', 'n', '1', '2', None"),
    "d.csv": ("specimen,landmark,x,y,z\na,n,1,2,3", "last line has no end"),
    "e.csv": ("specimen,landmark,x,y,z\na,n,1,2,1_0\n", "'1_0' is no number"),
    "f.csv": ("specimen,landmark,x,y,z\na,n,1,2,NA\n", "all three numbers of a missing one"),
    "g.csv": ("specimen,landmark,x,y,z\na,n,1,2,inf\n", "Points must be finite"),
    "h.csv": ("specimen,landmark,x,y,z\n", "at least one specimen"),
    "i.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\na,n,1,2,3\n", "Names of landmarks must differ; 'n'"),
    "j.csv": ("specimen,landmark,x,y,z,spread\na,n,1,2,3,-1\n", "each at least 0"),
    "k.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\nb,n,1,2,3\nb,m,1,2,3\n", "'b' has '2 landmarks'"),
    "a.tps": ("LM=1\n1 2\n", "points must be in space"),
    "b.tps": ("LM3=2\n1 2 3\n", "has LM3=2, 1 points"),
    "c.tps": ("LM3=1\n1 2\n", "must have three numbers; a line is '1 2'"),
    "d.tps": ("1 2 3\n", "must begin with LM3="),
    "e.tps": ("LM3=1\n1 2 3\nID=a\nLM3=1\n1 2 3\n", "must have ID=; specimen 1"),
    "f.tps": ("LM3=1\n1 2 3\nID=a\nLM3=1\n1 2 3\nID=a\n", "must have different names; two are 'a'"),
    "g.tps": ("LM3=1\n1 2 3\nSCALE=NA\n", "SCALE= positive; specimen 0 has LM3=1, 1 points and a scale of nan"),
    "a.txt": ("[individuals]\n1\n[landmarks]\n2\n[dimensions]\n3\n[rawpoints]\n1 2 3\n", "1 times 2 points"),
    "b.txt": ("1 2 3\n", "structure differs, KeyError"),
    "a.fcsv": ("1,2\n", "must have 14 cells"),
    "b.fcsv": ("# CoordinateSystem = IJK\nF,1,2,3,0,0,0,1,1,1,0,n,,\n", "LPS or RAS; it is 'IJK'"),
    "a.mrk.json": ("{", "must hold landmarks"),
    "b.mrk.json": ("[" * 100_000, "structure differs, RecursionError"),
    "c.mrk.json": ('{"markups": [{"controlPoints": [{"position": [1, 2]}]}]}', "three numbers; '1' is .1, 2"),
    "d.mrk.json": ('{"markups": [{"controlPoints": [{"label": "a\\nb", "position": [1, 2, 3]}]}]}', "must be a text"),
    "e.mrk.json": ('{"markups": []}', "at least one specimen"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_with_what_is_wrong(name, tmp_path):
    text, message = WRONG[name]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(es.FileFormatError, match=message):
        es.morphometrics.read_specimens(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_is_cut_is_refused_or_holds_the_specimens_that_are_whole(suffix, tmp_path):
    given = {"only": specimen()} if suffix in OF_ONE else {"one": specimen(), "two": specimen(1)}
    whole = {name: kept(each, suffix) for name, each in given.items()}
    path = tmp_path / f"only{suffix}"
    es.morphometrics.write_landmarks(given, path)
    data = path.read_bytes()
    n_read = 0
    for length in range(0, len(data), 1 + len(data) // 900):
        path.write_bytes(data[:length])
        try:
            found = es.morphometrics.read_specimens(path)
        except es.FileFormatError:
            continue
        n_read += 1
        # Lines of some formats say nothing of those that are missing after them.
        for one, two in zip(found.values(), whole.values(), strict=False):
            k = len(one.names)
            assert one.names == two.names[:k]
            np.testing.assert_array_equal(one.points, two.points[:k])
            assert one.curves == two.curves
            assert k == len(two.names) or suffix in (".fcsv", ".csv")
    assert n_read < len(data) / 10


@pytest.mark.parametrize("suffix", FORMATS)
def test_garbled_bytes_are_refused_by_an_error_of_ours_or_read(suffix, tmp_path):
    rng = np.random.default_rng(0)
    path = tmp_path / f"a{suffix}"
    es.morphometrics.write_landmarks(specimen(), path)
    data = np.frombuffer(path.read_bytes(), np.uint8)
    n_refused = 0
    for _ in range(300):
        garbled = data.copy()
        places = rng.integers(len(data), size=2)
        garbled[places] = rng.choice(list(b"0-,.\"'[]{}=\n\x00\xff e#N"), size=2)
        path.write_bytes(garbled.tobytes())
        try:
            found = es.morphometrics.read_landmarks(path)
        except es.FileFormatError:
            n_refused += 1
        else:
            assert found.points.shape == (len(found.names), 3)
    assert n_refused > 30


@pytest.mark.data
def test_landmarks_of_real_skulls_are_read_and_come_back(data, tmp_path):
    paths = sorted((data / "mice").glob("*.mrk.json"))
    if not paths:
        pytest.skip(f"no landmark files in {data / 'mice'}")
    skulls = {path.name[:-9]: es.morphometrics.read_landmarks(path) for path in paths}
    assert {len(skull.names) for skull in skulls.values()} == {51}
    es.morphometrics.write_landmarks(skulls, tmp_path / "mice.csv")
    found = es.morphometrics.read_specimens(tmp_path / "mice.csv")
    assert all(same(found[name], skulls[name]) for name in skulls)
