"""A second shape, its map, landmarks and a collection: what the page gets of them."""

from tempfile import gettempdir

import numpy as np
import pytest
from balls import collection_of_balls
from conftest import stretched_ball
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from test_sessions import full_disk
from test_workspace import Page, file_of

import eigenshape as es
from certeig.kit.files import content_digest
from eigenshape.collections.parts import read_fits, write_state
from eigenshape.matching.spectral_refinement import corners_of_faces
from eigenshape_studio.calls import RequestError
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.others.beside import Beside
from eigenshape_studio.others.mapping import NEAR, correct_map, map_of_match
from eigenshape_studio.tab.sessions import SessionFile
from eigenshape_studio.tab.workspace import Workspace


@pytest.fixture(scope="module")
def poses():
    """Two poses of an animal, whose vertices correspond by number."""
    return [es.make_creature("quadruped", pose, n_vertices=500) for pose in (0, 1)]


def match_of(whole, places, sure=0.9):
    """Return the match that sends each vertex of a part to a vertex of the whole."""
    faces, weights = corners_of_faces(whole, places)
    return es.matching.ShapeMatch(
        vertices=places,
        faces=faces,
        corners=whole.faces[faces],
        weights=weights,
        confidence=np.full(len(places), sure),
        evidence=np.zeros((len(places), 12)),
        score=1.0,
        orientation=1.0,
        coverage=1.0,
        handed=True,
        n_equally_good=1,
        scale=1.0,
        report=(),
    )


def errors(found):
    """Return how far each vertex of the part is from where it belongs, in √area of the whole."""
    whole = found.meshes[1]
    away = np.linalg.norm(found.placed[0].points - whole.vertices, axis=1)
    return away / np.sqrt(es.geometry.surface_area(whole))


def quiet(_share, _text):
    """Take no notice of progress."""


def test_a_scan_is_mapped_to_the_whole_from_the_page(poses):
    """The second shape is open, so it is the part; both sides get what they ask for."""
    whole, other = poses
    scan = es.partial_scan(other, [1, 0, 0])
    page = Page(Workspace(whole))
    assert "none is open" in page.error("finish", kind="map")["message"]
    found, _ = page.call(
        "finish", kind="beside", name="scan.ply", _arrays={"file": file_of(scan.mesh)}
    )
    beside = found["state"]["beside"]
    assert (beside["name"], beside["n_vertices"]) == ("scan.ply", scan.mesh.n_vertices)
    assert beside["map"]["status"] == "none"
    assert "must be ready" in page.error("array", name="beside/partners/0")["message"]
    pairs = {"pairs": np.array([0, 0], "<u4")}
    assert "find it first" in page.error("finish", kind="correct", _arrays=pairs)["message"]
    page.call("finish", kind="map")
    assert page.workspace.company.beside.job.wait(600)
    np.testing.assert_allclose(
        page.array("beside/vertices").reshape(-1, 3), scan.mesh.vertices, atol=1e-6
    )
    np.testing.assert_array_equal(page.array("beside/faces"), scan.mesh.faces)

    partners = page.array("beside/partners/1")
    away = whole.vertices[partners] - whole.vertices[scan.source_vertices]
    away = np.linalg.norm(away, axis=1) / np.sqrt(es.geometry.surface_area(whole))
    assert np.median(away) < NEAR
    back = page.array("beside/partners/0")
    assert back.shape == (whole.n_vertices,)
    assert (back < 0).any()  # what the scanner did not see
    assert (page.array("beside/confidence/0")[back < 0] == 0).all()
    ours, theirs = (
        page.array(f"beside/colors/{side}").reshape(-1, 3).astype(int) for side in (0, 1)
    )
    sure = page.array("beside/confidence/1")
    sure = sure > np.quantile(sure, 0.7)
    assert np.median(np.abs(theirs[sure] - ours[partners[sure]])) <= 10
    assert (ours[back < 0] == 150).all()  # gray

    # A landmark goes to the part that was seen.
    seen = int(scan.source_vertices[sure][0])
    points = {"points": whole.vertices[seen].astype("<f8")}
    page.call("finish", kind="landmarks", names=["ear"], _arrays=points)
    near = scan.mesh.vertices[page.array("landmarks/1/vertices")[0]]
    goal = scan.mesh.vertices[np.flatnonzero(scan.source_vertices == seen)[0]]
    assert np.linalg.norm(near - goal) < 0.1 * np.sqrt(es.geometry.surface_area(whole))
    # What the scanner did not see has no place there.
    hidden = whole.vertices[np.flatnonzero(back < 0)[:1]]
    page.call("finish", kind="landmarks", names=["far"], _arrays={"points": hidden.ravel()})
    assert page.array("landmarks/1/vertices").tolist() == [-1]
    assert "whole first shape" in page.error("finish", kind="pose")["message"]
    assert "of sides 0 and 1" in page.error("array", name="beside/colors/2")["message"]
    found, _ = page.call("finish", kind="beside", close=True)
    assert found["state"]["beside"] is None


def test_points_given_by_hand_move_what_is_around_them(poses):
    part, whole = poses
    mirror = cKDTree(part.vertices).query(part.vertices * [-1, 1, 1])[1]
    low = part.vertices[:, 1] < np.quantile(part.vertices[:, 1], 0.25)
    exchanged = np.where(low, mirror, np.arange(part.n_vertices))  # left and right legs
    match = match_of(whole, exchanged)
    before = map_of_match(part, whole, match)
    feet = [v for v in es.geometry.farthest_points(part, 8)[0] if low[v]][:2]
    after = correct_map(before, match, np.repeat(feet, 2).reshape(-1, 2), quiet)
    assert errors(before)[low].mean() > 0.1
    assert errors(after)[low].mean() < 0.02
    assert errors(after)[~low].mean() < 0.01
    assert (errors(after)[feet] < 1e-9).all()
    assert (after.placed[0].confidence[feet] == 1).all()
    # Where the map has moved nothing was measured.
    assert set(np.round(after.placed[0].confidence, 3)) <= {0.5, 0.9, 1.0}


def test_what_lies_elsewhere_is_seen_from_the_same_side(poses):
    part = poses[0]
    turn = Rotation.from_rotvec([0.3, 2.0, -0.5]).as_matrix()
    whole = es.TriangleMesh(3 * part.vertices @ turn.T + [1, 2, 3], part.faces)
    found = map_of_match(part, whole, match_of(whole, np.arange(part.n_vertices)))
    beside = Beside(part, whole, "turned", 1, found)
    assert beside.job.wait(600)
    laid = np.reshape(beside.facts()["similarity"], (3, 4))
    np.testing.assert_allclose(laid, np.column_stack([3 * turn, [1, 2, 3]]), atol=1e-12)
    back = found.similarity(1)
    np.testing.assert_allclose(back[:, :3] @ laid[:, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(back[:, :3] @ laid[:, 3] + back[:, 3], 0, atol=1e-12)
    np.testing.assert_allclose(beside.carry(part.vertices[:3]), whole.vertices[:3], atol=1e-9)


def test_a_correction_is_made_and_taken_back(poses):
    part, whole = poses
    first = map_of_match(part, whole, match_of(whole, np.arange(part.n_vertices)))
    beside = Beside(part, whole, "other", 1, first)
    assert beside.job.wait(600)
    near = int(np.argsort(np.linalg.norm(whole.vertices - whole.vertices[7], axis=1))[4])
    beside.correct(beside.check_pairs(np.array([7, near], "<u4")))
    assert beside.job.wait(600)
    assert beside.array("partners/0")[7] == near
    assert beside.facts()["pairs"] == [[7, near]]
    beside.correct(beside.check_pairs(np.empty(0, "<u4")))
    assert beside.job.wait(600)
    assert beside.require_map() is first
    for pairs, reason in (([7], "pairs of vertices"), ([7, 500], r"pair 0 is \[7, 500\]")):
        with pytest.raises(RequestError, match=reason):
            beside.check_pairs(np.array(pairs, "<u4"))
    bent = beside.take_pose()
    np.testing.assert_array_equal(bent.faces, part.faces)
    away = np.linalg.norm(bent.vertices - whole.vertices, axis=1)
    still = np.linalg.norm(part.vertices - whole.vertices, axis=1)
    assert away.mean() < 0.5 * still.mean()
    # The map is that of the new pose, too, and can be corrected there.
    posed = beside.of_pose(bent)
    assert posed.is_of(bent, 1)
    assert posed.job.wait(600)
    np.testing.assert_array_equal(posed.array("partners/0"), beside.array("partners/0"))
    assert posed.check_pairs(np.array([7, near], "<u4")).tolist() == [[7, near]]


def test_a_map_and_what_it_carries_are_kept_over_a_restart(poses, tmp_path, monkeypatch):
    """Also that of a pose that was taken over; on a full disk it is not found, and the page says why."""
    shape, other = poses
    first = Workspace(shape, "a", shared=True)
    path = tmp_path / "tab.sqlite"

    def find(part, whole, progress):
        return match_of(whole, np.arange(part.n_vertices))

    monkeypatch.setattr(es, "match_shapes", find)
    page = Page(first.fork(SessionFile(path)))
    points = {"points": shape.vertices[[3, 70]].ravel()}
    page.call("finish", kind="landmarks", names=["nose", "tail"], _arrays=points)
    page.call("finish", kind="beside", name="b.ply", _arrays={"file": file_of(other)})
    before = page.workspace.company.beside
    with full_disk():
        page.call("finish", kind="map")
        assert before.job.wait(60)
    assert before.facts()["map"]["status"] == "failed"
    assert "needs space on its disk" in before.facts()["map"]["message"]
    for _ in range(2):
        page.call("finish", kind="map")
        assert page.workspace.company.beside.job.wait(60)
        names = ["beside/partners/0", "beside/colors/1", "landmarks/1/vertices", "landmarks/1/csv"]
        found = [page.array(name) for name in names]
        again = Page(first.fork(SessionFile(path)))
        assert again.workspace.company.beside.job.wait(60)
        state = again.call("meta")[0]
        assert state["losses"] == []
        assert state["beside"] == page.call("meta")[0]["beside"]
        for name, array in zip(names, found, strict=True):
            np.testing.assert_array_equal(again.array(name), array)
        page.call("finish", kind="pose")
        page.call("finish", kind="landmarks", names=["nose", "tail"], _arrays=points)


def test_a_second_shape_of_a_file_is_kept_when_the_file_has_gone(tmp_path):
    files = [tmp_path / "a.ply", tmp_path / "b.ply"]
    for number, path in enumerate(files, 1):
        es.write_mesh(es.icosphere(number), path)
    first = open_workspace(files)
    page = Page(first.fork(SessionFile(tmp_path / "tab.sqlite")))
    assert page.call("meta")[0]["beside"]["n_vertices"] == 162
    regions = {"regions": np.zeros(42, np.uint8)}
    page.call("finish", kind="select", _arrays=regions)
    files[1].unlink()
    state = Page(first.fork(SessionFile(tmp_path / "tab.sqlite"))).call("meta")[0]
    assert (state["beside"]["n_vertices"], state["losses"]) == (162, [])
    # Another tab did not read it before.
    state = Page(first.fork(SessionFile(tmp_path / "other.sqlite"))).call("meta")[0]
    state = Page(first.fork(SessionFile(tmp_path / "other.sqlite"))).call("meta")[0]
    assert state["beside"] is None
    assert "b.ply cannot stand beside the shape any more" in state["losses"][0]


def test_landmarks_are_placed_saved_and_loaded():
    ball = stretched_ball()
    page = Page(Workspace(ball))
    points = {"points": (1.05 * ball.vertices[[3, 5]]).astype("<f8").ravel()}
    found, _ = page.call("finish", kind="landmarks", names=["nose", "tail"], _arrays=points)
    assert "moved to the surface" in found["warnings"][0]
    placed = found["state"]["landmarks"]
    assert [each["name"] for each in placed] == ["nose", "tail"]
    for ending in ("mrk.json", "fcsv", "csv"):
        file = page.array(f"landmarks/0/{ending}")
        page.call("finish", kind="landmarks", names=[])
        assert page.call("meta")[0]["landmarks"] == []
        found, _ = page.call("finish", kind="landmarks", name=f"a.{ending}", _arrays={"file": file})
        assert found["warnings"] == []
        again = found["state"]["landmarks"]
        assert [each["name"] for each in again] == ["nose", "tail"]
        for one, two in zip(placed, again, strict=True):
            np.testing.assert_allclose(one["point"], two["point"], atol=1e-12)
    text = (
        b'{"markups": [{"coordinateUnits": "m", "controlPoints": [{"position": [0, 0, 0.001]}]}]}'
    )
    file = {"file": np.frombuffer(text, "|u1")}
    found, _ = Page(Workspace(es.icosphere(1))).call(
        "finish", kind="landmarks", name="a.mrk.json", _arrays=file
    )
    assert found["warnings"][0] == "a.mrk.json: its points are in m and were converted to mm"
    two_shapes = page.call(
        "finish", kind="open", name="b.ply", _arrays={"file": file_of(es.icosphere(1))}
    )
    assert two_shapes[0]["state"]["landmarks"] == []  # those of the other shape
    assert page.call("finish", kind="choose", shape=0)[0]["state"]["landmarks"] == again


FAR_POINTS = b"Version 1.0\n3\na .01 0 0\nb 0 .01 0\nc 0 0 .01\n"
WRONG = [
    ({}, {}, "names must be a list"),
    ({"names": ["a"]}, {}, "three coordinates for each"),
    ({"names": ["a", "a"]}, {"points": [0.0] * 6}, "must differ"),
    ({"names": [""]}, {"points": [0.0] * 3}, "must be a text"),
    ({"names": ["a"]}, {"points": [0.0, 0.0, np.inf]}, "must be finite"),
    ({"name": "a.obj"}, {"file": b"v 0 0 0"}, "Files of landmarks that are read end in"),
    ({"name": "a.pp"}, {"file": b"<a"}, "a.pp must hold landmarks"),
    ({"names": ["a"]}, {"points": [9.0, 0.0, 0.0]}, "must lie on the surface of their specimen"),
    ({"name": "a.pts"}, {"file": FAR_POINTS}, "100 times as large they would lie on it"),
]


@pytest.mark.parametrize(("meta", "arrays", "reason"), WRONG)
def test_wrong_landmarks_are_refused(meta, arrays, reason):
    page = Page(Workspace(es.icosphere(1)))
    given = {
        name: np.frombuffer(value, "|u1") if isinstance(value, bytes) else np.array(value, "<f8")
        for name, value in arrays.items()
    }
    message = page.error("finish", meta, given, kind="landmarks")["message"]
    assert reason in message
    assert gettempdir() not in message
    assert "at least one" in page.error("array", name="landmarks/0/fcsv")["message"]
    assert "side 0 or 1" in page.error("array", name="landmarks/2/fcsv")["message"]
    assert (
        "open the studio with its folder" in page.error("array", name="collection/modes")["message"]
    )


def test_the_points_of_a_cloud_are_kept_beside_its_surface(tmp_path):
    cloud = tmp_path / "ball.xyz"
    es.io.write_points(es.PointCloud(es.icosphere(3).vertices), cloud)
    opened = Page(open_workspace([cloud]).fork(SessionFile(tmp_path / "tab.sqlite")))
    assert opened.call("meta")[0]["n_points"] == 642
    uploaded = Page(Workspace(es.icosphere(1)).fork(SessionFile(tmp_path / "other.sqlite")))
    assert uploaded.call("meta")[0]["n_points"] == 0
    assert "there are none" in uploaded.error("array", name="points")["message"]
    file = np.frombuffer(cloud.read_bytes(), np.uint8)
    uploaded.call("finish", kind="open", name="ball.xyz", _arrays={"file": file})
    again = Page(Workspace(es.icosphere(1)).fork(SessionFile(tmp_path / "other.sqlite")))
    for page in (opened, uploaded, again):
        points = page.array("points").reshape(-1, 3)
        np.testing.assert_allclose(points, es.icosphere(3).vertices, atol=1e-6)
        assert page.workspace.mesh.n_vertices != 642


@pytest.fixture(scope="module")
def collection(tmp_path_factory):
    """The folder of a collection of three balls."""
    folder = tmp_path_factory.mktemp("balls")
    made = collection_of_balls(folder, ("a", "b", "c"), level=2, note="a note")
    fits, rows = [], []
    for name, source, own in zip(made.names, made.sources, made.points, strict=True):
        exact, sure = np.zeros(len(own)), np.ones(len(own))
        fits.append(
            es.collections.SurfaceFit(own, exact, sure, 0.0, 0.0, 0.0, 0.0, "same", "position")
        )
        row = {"name": name, "key": name, "source": str(source), "digest": content_digest(source)}
        rows.append(row | {"notes": made.notes[name]})
    facts = {"template": made.template, "specimens": rows, "failures": made.failures}
    read_fits(folder)
    write_state(folder, facts, made.mean, fits, made.names)
    return folder


def test_a_collection_opens_with_its_mean_modes_and_specimens(collection):
    first = open_workspace([collection])
    page = Page(first.fork())
    state = page.call("meta")[0]
    assert "collection" in state["capabilities"]
    facts = state["collection"]
    assert [each["name"] for each in facts["specimens"]] == ["a", "b", "c"]
    assert facts["failures"] == [["d", "it could not be read"]]
    assert facts["is_mean"]
    # The sliders at the scores of a specimen give its shape, up to size and place.
    modes = page.array("collection/modes").reshape(len(facts["shares"]), -1, 3)
    scores = facts["specimens"][1]["scores"]
    bent = page.array("vertices").reshape(-1, 3) + np.tensordot(scores, modes, axes=1)
    shape = es.morphometrics.fit_procrustes([bent, es.read_mesh(collection / "b.ply").vertices])
    assert np.linalg.norm(shape.shapes[0] - shape.shapes[1]) < 1e-3

    state = page.call("finish", kind="beside", specimen="b")[0]["state"]
    assert page.workspace.company.beside.job.wait(600)
    np.testing.assert_array_equal(page.array("beside/partners/0"), np.arange(162))
    assert (
        "must be that of a specimen" in page.error("finish", kind="beside", specimen="x")["message"]
    )
    pairs = {"pairs": np.array([0, 1], "<u4")}
    beside = page.call("meta")[0]["beside"]
    assert (beside["can_correct"], beside["can_pose"]) == (False, False)
    assert "kept as it is" in page.error("finish", kind="correct", _arrays=pairs)["message"]
    state = page.call("finish", kind="choose", shape=1)[0]["state"]
    assert (state["name"], state["collection"]["is_mean"]) == ("b", False)
    assert page.call("finish", kind="mean")[0]["state"]["collection"]["is_mean"]
    first.close()
