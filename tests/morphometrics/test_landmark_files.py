"""Landmarks come back from each format as they were, and a damaged file is refused or rightly read."""

import json

import numpy as np
import pytest

import eigenshape as es
from eigenshape.morphometrics.landmark_files import LENGTHS, OF_ONE, WRITERS

HOLD_POINTS = [suffix for suffix in WRITERS if suffix != ".sliders.csv"]  # which has rows alone
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


@pytest.mark.parametrize("suffix", HOLD_POINTS)
def test_landmarks_come_back_to_the_last_bit(suffix, tmp_path):
    path = tmp_path / f"A skull{suffix}"
    es.morphometrics.write_landmarks(specimen(), path)
    assert same(es.morphometrics.read_landmarks(path), kept(specimen(), suffix))
    assert list(es.morphometrics.read_specimens(path)) == ["A skull"]


@pytest.mark.parametrize("suffix", [each for each in HOLD_POINTS if each not in OF_ONE])
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


AMIRA = """# AmiraMesh 3D ASCII 2.0
define Markers 2
Parameters { NumSets 1, ContentType "LandmarkSet" }
Markers { float[3] Coordinates } @1
# Data section follows
@1
1.0e+00 2 3
4 5 6
"""
PICKED = """<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData><User name="me"/></DocumentData>
 <point active="1" name="nose" z="3" y="2" x="1"/>
 <point active="0" name="" z="0" y="0" x="0"/>
</PickedPoints>
"""
NTSYS = (
    '"two specimens\n1 2L 6L 1 9999 Dim=3\nA B\na b c d e f\n1 2 3 4 5 6\n1 2 3 9999 9999 9999\n'
)
EDITOR = "Version 1.0\n3\nS000 1 2 3\nC000 001 4 5 6\nS001 9999 9999 9999\n"


def slicer(**entries):
    """Return a list of Slicer with two points."""
    points = [{"label": "nose", "position": [1, 2, 3]}, {"label": "ear", "position": [4, 5, 6]}]
    return json.dumps({"markups": [{"type": "Fiducial", "controlPoints": points, **entries}]})


WRONG = {
    "a.ply": ("", "Files of landmarks that are read end in"),
    "a.csv": ("specimen,landmark,x,y\n", "z is missing"),
    "b.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\nb,m,1,2,3\n", "same landmarks in the same order.*'b' has 'm'"),
    "c.csv": ("specimen,landmark,x,y,z\na,n,1,2\n", "as many cells as the first; one is .'a', 'n', '1', '2', None"),
    "e.csv": ("specimen,landmark,x,y,z\na,n,1,2,1_0\n", "'1_0' is no number"),
    "f.csv": ("specimen,landmark,x,y,z\na,n,1,2,NA\n", "all three numbers of a missing one"),
    "g.csv": ("specimen,landmark,x,y,z\na,n,1,2,inf\n", "Points must be finite"),
    "h.csv": ("specimen,landmark,x,y,z\n", "at least one specimen"),
    "i.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\na,n,1,2,3\n", "Names of landmarks must differ; 'n'"),
    "j.csv": ("specimen,landmark,x,y,z,spread\na,n,1,2,3,-1\n", "each at least 0"),
    "k.csv": ("specimen,landmark,x,y,z\na,n,1,2,3\nb,n,1,2,3\nb,m,1,2,3\n", "'b' has '2 landmarks'"),
    "a.tps": ("LM=1\n1 2 3\n", "must have 2 numbers; a line is '1 2 3'"),
    "b.tps": ("LM3=2\n1 2 3\n", "'1' has LM3=2, and there are 1"),
    "c.tps": ("LM3=1\n1 2\n", "must have 3 numbers; a line is '1 2'"),
    "d.tps": ("1 2 3\n", "must begin with LM3="),
    "e.tps": ("LM3=1\n1 2 3\nID=a\nLM3=1\n1 2 3\nSCALE=2\n", "must have SCALE=; '2' differs from 'a'. Write SCALE=1"),
    "f.tps": ("LM3=1\n1 2 3\nID=a\nLM3=1\n1 2 3\nID=a\n", "must have different names; two are 'a'"),
    "g.tps": ("LM3=1\n1 2 3\nSCALE=NA\n", "SCALE= must be positive; that of '1' is nan"),
    "h.tps": ("LM3=1\n1 2 3\nCURVES=1\nPOINTS=2\n1 2 3\nID=a\n", "'a' has POINTS=2, and there are 1"),
    "i.tps": ("LM3=1\n1 2 3\nCURVES=2\nPOINTS=1\n1 2 3\nID=a\n", "'a' has CURVES=2, and there are 1"),
    "j.tps": ("LM3=1\n1 2 3\nID=2\nLM3=1\n1 2 3\n", "two are '2'. Rename one in the file"),
    "a.nts": ("1 2B 6 0 DIM=3\n", "must begin as '1 4L 30L 0 DIM=3'.*it begins with '1 2B 6"),
    "b.nts": ("1 2 6 0 DIM=3\n1 2 3\n", "must be 2 times 6 numbers, and 3 for each point; there are 3"),
    "c.nts": ("1 1 4 0 DIM=3\n1 2 3 4\n", "must be 1 times 4 numbers, and 3"),
    "a.pp": ("<PickedPoints>", "must hold landmarks: no element found"),
    "b.pp": ("<PickedPoints><point x='1' y='2'/></PickedPoints>", "structure differs, KeyError"),
    "a.pts": ("1 2 3\n", "must begin with 'Version 1.0'.*read by read_shape"),
    "b.pts": ("Version 1.0\n2\nS0 1 2 3\n", "second line says; it says '2', and there are 1"),
    "a.landmarkAscii": ("# AmiraMesh BINARY 2.0\ndefine Markers 1\n", "Save them as Amira Landmark ASCII"),
    "b.landmarkAscii": (AMIRA.replace("Markers 2", "Markers 3"), "must have 3 landmarks, as declared; @1 has 2"),
    "u.mrk.json": (slicer(coordinateUnits="px"), "unit of length must be one of m, cm, mm, um, nm, inch; it is 'px'"),
    "v.mrk.json": (slicer(coordinateUnits="m")[:-2] + "," + slicer()[13:], "must be in one unit; they are in m and mm"),
    "a.txt": ("[individuals]\n1\n[landmarks]\n2\n[dimensions]\n3\n[rawpoints]\n1 2 3\n", "1 times 2 points"),
    "b.txt": ("1 2 3\n", "structure differs, KeyError"),
    "a.fcsv": ("1,2\n", "must have 14 cells"),
    "b.fcsv": ("# CoordinateSystem = IJK\nF,1,2,3,0,0,0,1,1,1,0,n,,\n", "LPS or RAS; it is 'IJK'"),
    "a.mrk.json": ("{", "must hold landmarks"),
    "b.mrk.json": ("[" * 100_000, "structure differs, RecursionError"),
    "c.mrk.json": ('{"markups": [{"controlPoints": [{"position": [1, 2]}]}]}', "3 numbers; '1' is .1, 2"),
    "d.mrk.json": ('{"markups": [{"controlPoints": [{"label": "a\\nb", "position": [1, 2, 3]}]}]}', "must be a text"),
    "e.mrk.json": ('{"markups": []}', "at least one specimen"),
}  # fmt: skip


def read(name, text, tmp_path, **options):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return es.morphometrics.read_specimens(tmp_path / name, **options)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("m", 1000), ("cm", 10), ("µm", 0.001), ("inch", 25.4), ("[in_i]", 25.4),
        (["m", "UCUM", "meter"], 1000), ({"codingSchemeDesignator": "UCUM", "codeValue": "cm"}, 10),
    ],
)  # fmt: skip
def test_points_in_another_unit_are_converted_and_that_is_said(unit, factor, tmp_path):
    text = slicer(coordinateUnits=unit)
    with pytest.warns(
        UserWarning, match=r"a\.mrk\.json: its points are in .* were converted to mm"
    ):
        found = read("a.mrk.json", text, tmp_path)
    np.testing.assert_allclose(found["a"].points[0], factor * np.array([1, 2, 3]), rtol=1e-15)


@pytest.mark.parametrize("unit", ["mm", None, ["mm", "mm", "mm"], "MM"])
def test_the_unit_of_slicer_is_the_millimeter(unit, tmp_path):
    found = read("a.json", slicer(coordinateUnits=unit), tmp_path)
    assert found["a"].points.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_the_unit_of_the_meshes_can_be_named(tmp_path):
    text = slicer(coordinateUnits="um")
    assert read("a.mrk.json", text, tmp_path, unit="um")["a"].points[0].tolist() == [1, 2, 3]
    text = AMIRA.replace("NumSets 1,", 'NumSets 1, Units { Coordinates "m" }')
    with pytest.warns(UserWarning, match="are in m and were converted to cm"):
        found = read("a.landmarkAscii", text, tmp_path, unit="cm")
    assert found["a"].points.tolist() == [[100, 200, 300], [400, 500, 600]]
    # Other formats name no unit.
    found = read("a.csv", "specimen,landmark,x,y,z\na,n,1,2,3\n", tmp_path, unit="m")
    assert found["a"].points.tolist() == [[1, 2, 3]]
    with pytest.raises(es.InvalidParameterError, match="it is 'parsec'"):
        es.morphometrics.read_landmarks(tmp_path / "a.mrk.json", unit="parsec")
    assert sum(map(len, LENGTHS.values())) == len(
        {name for each in LENGTHS.values() for name in each}
    )


def test_labels_that_occur_again_get_numbers(tmp_path):
    lists = slicer()[:-2] + "," + slicer()[13:]
    with pytest.warns(UserWarning, match=r"got numbers, 'nose \(2\)' and 1 others"):
        found = read("a.mrk.json", lists, tmp_path)["a"]
    assert found.names == ("nose", "ear", "nose (2)", "ear (2)")
    row = ",4,5,6,0,0,0,1,1,1,0,nose,,\n"
    with pytest.warns(UserWarning, match="labels that occur again"):
        assert read("a.fcsv", f"1{row}2{row}", tmp_path)["a"].names == ("nose", "nose (2)")


def test_curves_of_a_tps_file_follow_its_landmarks(tmp_path):
    text = "LM3=1\n1 2 3\nCURVES=1\nPOINTS=2\n1 1 1\n2 2 2\nSCALE=2\nID=a\n"
    found = read("a.tps", text, tmp_path)["a"]
    assert found.points.tolist() == [[2, 4, 6], [2, 2, 2], [4, 4, 4]]
    assert found.curves == ((1, 2),)
    # There may be no landmark where there are curves alone, and outlines have no points that correspond.
    text = "LM3=0\nCURVES=2\nPOINTS=2\n1 1 0\n2 2 0\nPOINTS=1\n3 3 0\nOUTLINES=1\nPOINTS=1\n9 9 0\n"
    with pytest.warns(UserWarning, match="OUTLINES are not read"):
        found = read("b.tps", text, tmp_path)["1"]
    assert found.points.tolist() == [[1, 1, 0], [2, 2, 0], [3, 3, 0]]
    assert found.curves == ((0, 1), (2,))


def test_points_in_a_plane_are_read_and_named(tmp_path):
    corner, mirrored = "0 0\n3 0\n0 1\n", "0 0\n-3 0\n0 1\n"
    with pytest.warns(UserWarning, match="in a plane and are read with z = 0"):
        found = read("a.tps", f"LM=3\n{corner}ID=a\nLM=3\n{mirrored}ID=b\n", tmp_path)
    assert found["a"].points.tolist() == [[0, 0, 0], [3, 0, 0], [0, 1, 0]]
    # A planar form is not its mirror image.
    assert es.morphometrics.fit_procrustes(found).distances().max() > 0.1
    with pytest.warns(UserWarning, match="in a plane"):
        found = read("a.nts", f"1 3 2 0 DIM=2\n{corner}", tmp_path)["a"]
    assert found.points.tolist() == [[0, 0, 0], [3, 0, 0], [0, 1, 0]]
    text = "[individuals]\n1\n[landmarks]\n2\n[dimensions]\n2\n[rawpoints]\n1 2\nNA NA\n"
    with pytest.warns(UserWarning, match="in a plane"):
        found = read("a.txt", text, tmp_path)["1"]
    np.testing.assert_array_equal(found.points, [[1, 2, 0], [np.nan] * 3])


def test_fields_of_some_specimens_of_a_tps_file_are_no_matter(tmp_path):
    one, two = "LM3=1\n1 2 3\n", "LM3=1\n4 5 6\nCOMMENT=left broken\nVARIABLES=a\n"
    assert list(read("a.tps", f"{one}ID=a\n{two}", tmp_path)) == ["a", "2"]
    assert list(read("b.tps", f"{one}{two}IMAGE=b.jpg\n", tmp_path)) == ["1", "b.jpg"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.tps", "LM3=1\n1 2 3\nID=a"), ("a.csv", "specimen,landmark,x,y,z\na,1,1,2,3"),
        ("a.nts", "1 1L 3 0 DIM=3\na\n1 2 3"), ("a.pts", "Version 1.0\n1\n1 1 2 3"),
    ],
)  # fmt: skip
def test_a_file_without_a_last_line_break_is_read_and_that_is_said(name, text, tmp_path):
    with pytest.warns(
        UserWarning, match="its last line has no line break; if the file was cut off"
    ):
        found = read(name, text, tmp_path)
    assert found["a"].names == ("1",)
    assert found["a"].points.tolist() == [[1, 2, 3]]


def test_files_of_programs_that_place_landmarks_are_read(tmp_path):
    found = read("a.nts", NTSYS, tmp_path)
    assert list(found) == ["A", "B"]
    np.testing.assert_array_equal(found["B"].points, [[1, 2, 3], [np.nan] * 3])
    # geomorph's digit.fixed writes a row for each landmark of one specimen.
    found = read("b.dta", "1 2 3 0 dim=3\n1 2 3\n4 5 6\n", tmp_path)
    assert found["b"].points.tolist() == [[1, 2, 3], [4, 5, 6]]
    found = read("a.pp", PICKED, tmp_path)["a"]
    assert found.names == ("nose", "2")
    np.testing.assert_array_equal(found.points, [[1, 2, 3], [np.nan] * 3])
    found = read("a.pts", EDITOR, tmp_path)["a"]
    assert found.names == ("S000", "C000 001", "S001")
    np.testing.assert_array_equal(found.points, [[1, 2, 3], [4, 5, 6], [np.nan] * 3])
    (tmp_path / "a.landmarkAscii").write_bytes(AMIRA.replace("\n", "\r\n").encode())
    found = es.morphometrics.read_landmarks(tmp_path / "a.landmarkAscii")
    assert found.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    two = (
        AMIRA.replace("@1\n#", "@1\nMarkers { float[3] Coordinates2 } @2\n#") + "@2\n7 8 9\n1 1 1\n"
    )
    found = read("b.landmarkAscii", two, tmp_path)
    assert found["b 2"].points.tolist() == [[7, 8, 9], [1, 1, 1]]
    with pytest.raises(es.FileFormatError, match="that are written end in"):
        es.morphometrics.write_landmarks(found["b 1"], tmp_path / "a.pp")


def test_a_folder_of_landmarks_is_read_at_once(tmp_path):
    es.morphometrics.write_landmarks(specimen(0), tmp_path / "b.mrk.json")
    (tmp_path / "left").mkdir()
    es.morphometrics.write_landmarks(specimen(1), tmp_path / "left" / "a.fcsv")
    (tmp_path / "cloud.pts").write_text("1 2 3\n")
    (tmp_path / "README.txt").write_text("Skulls.\n")
    found = es.morphometrics.read_specimens(tmp_path)
    assert list(found) == ["b", "left/a"]
    np.testing.assert_array_equal(found["left/a"].points, some_points(1))
    es.morphometrics.write_landmarks(specimen(0), tmp_path / "b.fcsv")
    with pytest.raises(
        es.InvalidParameterError, match="must have one file of landmarks; 'b' has two"
    ):
        es.morphometrics.read_specimens(tmp_path)
    (tmp_path / "b.fcsv").write_text("1,4,5,6,0,0,0,1,1,1,0,nose,,\n")
    (tmp_path / "b.mrk.json").unlink()
    with pytest.raises(es.InvalidParameterError, match="'left/a' has 'nasion'"):
        es.morphometrics.read_specimens(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(es.FileFormatError, match="empty holds none"):
        es.morphometrics.read_specimens(tmp_path / "empty")


def test_several_specimens_of_a_file_in_a_folder_keep_their_names(tmp_path):
    (tmp_path / "all.tps").write_text("LM3=1\n1 2 3\nID=a\nLM3=1\n4 5 6\nID=b\n")
    (tmp_path / "c.pts").write_text("Version 1.0\n1\n1 7 8 9\n")
    assert list(es.morphometrics.read_specimens(tmp_path)) == ["a", "b", "c"]


@pytest.mark.data
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_everyday_files_are_read(data):
    everyday = data / "everyday"
    if not everyday.is_dir():
        pytest.skip(f"no {everyday}")
    found = es.morphometrics.read_landmarks(everyday / "M_curves.tps")
    assert found.curves == ((1, 2),)
    assert es.morphometrics.read_landmarks(everyday / "M_no_end.tps").points.tolist() == [[1, 2, 3]]
    found = es.morphometrics.read_landmarks(everyday / "M_two_lists.mrk.json")
    assert found.points.tolist() == [[1, 2, 3], [1, 2, 4]]
    found = es.morphometrics.read_landmarks(everyday / "G_metres" / "h0.mrk.json")
    assert 70 < np.abs(found.points).max() < 80  # millimeters


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_with_what_is_wrong(name, tmp_path):
    text, message = WRONG[name]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(es.FileFormatError, match=message):
        es.morphometrics.read_specimens(path)


@pytest.mark.parametrize("suffix", HOLD_POINTS)
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
        except (es.FileFormatError, UserWarning):  # refused, or said
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


@pytest.mark.parametrize("suffix", WRITERS)
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
        except (es.FileFormatError, UserWarning):
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


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("a.tps", "LM3=2\n0 1.5 2\n-1 -1 -1\nID=a\n", "1 point with -1 for each"),
        ("a.tps", "LM=3\n0 1.5\n-1 -1\n-1 -1\nID=a\n", "2 points with -1 for each"),
        (
            "a.csv",
            "specimen,landmark,x,y,z\ns,a,0,1,2\ns,b,-9999,-9999,-9999\n",
            "1 point with -9999 for each",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:.*in a plane")
def test_codes_of_missing_points_are_named(name, text, code, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.warns(UserWarning, match=f"{code} coordinate may stand for missing ones"):
        found = es.morphometrics.read_landmarks(tmp_path / name)
    assert np.isfinite(found.points).all()
