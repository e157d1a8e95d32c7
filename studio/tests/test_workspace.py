"""The five calls on a real shape: what the page gets is what the library computes."""

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from conftest import stretched_ball
from scipy.sparse import eye_array

import eigenshape as es
from eigenshape.geometry.topology import submesh
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.shape.loading import Loaded
from eigenshape_studio.tab.history import Shape
from eigenshape_studio.tab.workspace import Workspace
from eigenshape_studio.wire import decode, encode

TURN = {"type": "rotation", "pivot": [0, 0.9, 0], "axis": [0, 0, 2], "angle": 0.6}
PULL = {"type": "translation", "vector": [0, 0.4, 0.1]}
# A PNG file of one black pixel; what it shows is not read here.
IMAGE = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c6360000000020001"
    "48afa4710000000049454e44ae426082"
)
ROTATION, TRANSLATION = es.Rotation([0, 0.9, 0], [0, 0, 2], 0.6), es.Translation([0, 0.4, 0.1])


class Page:
    """What a page does: calls a workspace by messages."""

    def __init__(self, workspace):
        self.workspace = workspace

    def call(self, name, meta=None, /, _arrays=None, **more):
        answer = self.workspace.answer(name, encode((meta or {}) | more, _arrays))
        found, arrays = decode(answer.message)
        assert answer.status == 200, found
        return found, arrays

    def error(self, name, meta=None, /, _arrays=None, **more):
        answer = self.workspace.answer(name, encode((meta or {}) | more, _arrays))
        found, arrays = decode(answer.message)
        assert answer.status == 400, found
        assert not arrays
        return found["error"]

    def array(self, name, **more):
        return self.call("array", name=name, **more)[1][name]


@pytest.fixture(scope="session")
def ball_workspace():
    workspace = Workspace(stretched_ball(), "ball.ply", shared=True)
    assert workspace.analysis.rig.wait(600)
    assert workspace.analysis.health.wait(600)
    return workspace


@pytest.fixture
def page(ball_workspace):
    """Return a page of a tab of its own; the modes are computed once."""
    return Page(ball_workspace.fork())


@pytest.fixture
def top(page):
    return np.flatnonzero(page.workspace.mesh.vertices[:, 1] > 0.9).astype("<u4")


def file_of(mesh, suffix=".ply"):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"shape{suffix}")
        es.write_mesh(mesh, path)
        return np.frombuffer(path.read_bytes(), np.uint8)


def bend(page, top, handle=TURN, mode="graded"):
    page.call("rig", {"n_modes": None, "n_regions": 1, "fixed": False}, {"region0": top})
    return page.call("finish", kind="commit", handles=[handle], mode=mode)


def test_the_state_is_that_of_the_shape(page):
    state, arrays = page.call("meta")
    mesh = stretched_ball()
    assert not arrays
    assert (state["name"], state["n_vertices"], state["n_faces"]) == ("ball.ply", 642, 1280)
    np.testing.assert_allclose(state["center"], 0, atol=1e-12)
    assert state["extent"] == pytest.approx(2 * np.linalg.norm([1.0, 1.7, 0.8]), rel=1e-2)
    assert state["up"] == [0, 1, 0]
    np.testing.assert_allclose(state["towards"], es.plot.aim_camera(mesh).rotation[2], atol=1e-9)
    assert state["health"]["closed"]
    assert state["health"]["findings"] == []
    assert state["health"]["volume"] == es.geometry.enclosed_volume(mesh)
    assert state["spectrum"]["status"] == "ready"
    assert state["spectrum"]["k"] == 300
    assert state["spectrum"]["complete"]
    assert "none is missing" in state["spectrum"]["certificate"]
    assert state["deformation"]["status"] == "ready"
    assert state["parts"]["status"] == "none"
    assert state["index"] is None
    assert "query" not in state["capabilities"]


def test_arrays_are_those_of_the_library(page):
    mesh, spectrum = stretched_ball(), page.workspace.analysis.spectrum.result
    np.testing.assert_array_equal(page.array("vertices"), mesh.vertices.astype("<f4"))
    np.testing.assert_array_equal(page.array("faces"), mesh.faces)
    modes = page.array("modes", start=2, stop=5)
    np.testing.assert_array_equal(modes, spectrum.eigenvectors[:, 2:5].T.astype("<f4"))
    np.testing.assert_array_equal(page.array("eigenvalues"), spectrum.eigenvalues)
    assert page.array("areas").sum() == pytest.approx(es.geometry.surface_area(mesh))
    lower, upper = page.array("brackets", stop=8).T
    assert (lower <= upper).all()
    assert page.array("crossings").shape == (0, 2)
    skeleton = es.deformation.eigen_skeleton(page.workspace.analysis.rig.result, 12)
    np.testing.assert_array_equal(page.array("skeleton/12"), skeleton.astype("<f4"))


def test_a_disc_is_that_of_the_brush(page, top):
    mesh = page.workspace.mesh
    for vertex, radius in ((7, 0.4), (200, 0.9)):
        brush = es.deformation.BrushRegion(mesh.vertices[vertex], radius)
        wanted = np.flatnonzero(es.deformation.region_mask(mesh, brush))
        np.testing.assert_array_equal(page.array(f"disc/{vertex}/{radius}"), wanted)
    assert "vertex and its radius" in page.error("array", name="disc/7")["message"]
    for name in ("disc/642/0.5", "disc/-1/0.5", "disc/7/nan", "disc/7/0"):
        assert "positive, finite radius" in page.error("array", name=name)["message"]
    # The brush paints on the present pose.
    bend(page, top, TURN, "graded")
    bent = page.workspace.mesh
    brush = es.deformation.BrushRegion(bent.vertices[7], 0.4)
    wanted = np.flatnonzero(es.deformation.region_mask(bent, brush))
    np.testing.assert_array_equal(page.array("disc/7/0.4"), wanted)


def test_coefficients_express_the_present_pose(page):
    modes, coefficients = page.array("modes"), page.array("coefficients")
    mesh, spectrum = page.workspace.mesh, page.workspace.analysis.spectrum.result
    smooth = modes[:12].T @ coefficients[:12]
    kept = spectrum.eigenvectors[:, :12]
    np.testing.assert_allclose(smooth, kept @ (kept.T @ (spectrum.mass @ mesh.vertices)), atol=1e-5)


def test_shares_are_those_of_bind(page, top):
    facts, arrays = page.call("rig", n_modes=20, n_regions=1, fixed=False, _arrays={"region0": top})
    binding = es.deformation.bind(es.rig_shape(stretched_ball()), [top.astype(int)], n_modes=20)
    assert facts["n_modes"] == [20]
    np.testing.assert_array_equal(arrays["shares"][:, :1], binding.shares.T.astype("<f4"))
    assert not arrays["shares"][:, 1:].any()
    rim = es.deformation.region_boundary(page.workspace.mesh, np.isin(np.arange(642), top))
    np.testing.assert_allclose(facts["pivots"][0], page.workspace.mesh.vertices[rim].mean(axis=0))
    assert page.call("meta")[0]["deformation"]["regions"] == [len(top)]


@pytest.mark.parametrize("mode", ["graded", "uncrossed", "thesis"])
def test_a_commit_equals_deform_exactly(page, top, mode):
    shown = bend(page, top, TURN, mode)
    bent = es.deform(es.rig_shape(stretched_ball()), top.astype(int), ROTATION, mode=mode)
    np.testing.assert_array_equal(page.workspace.mesh.vertices, bent.vertices)
    np.testing.assert_array_equal(shown[1]["vertices"], bent.vertices.astype("<f4"))
    np.testing.assert_array_equal(page.array("vertices"), bent.vertices.astype("<f4"))
    state = shown[0]["state"]
    assert (state["pose"], state["shape"]) == (1, 0)
    assert state["deformation"]["mode"] == mode
    assert (state["deformation"]["n_edits"], state["history"], state["place"]) == (1, ["Bend"], 1)


def test_two_regions_and_fixed_vertices_are_those_of_bend(page, top):
    mesh = stretched_ball()
    bottom = np.flatnonzero(mesh.vertices[:, 1] < -0.9).astype("<u4")
    belt = np.flatnonzero(np.abs(mesh.vertices[:, 1]) < 0.2).astype("<u4")
    arrays = {"region0": top, "region1": bottom, "fixed": belt}
    page.call("rig", {"n_modes": 40, "n_regions": 2, "fixed": True}, arrays)
    _, found = page.call("finish", kind="commit", handles=[TURN, None], mode="graded")
    regions = [top.astype(int), bottom.astype(int)]
    rig = es.rig_shape(mesh)
    binding = es.deformation.bind(rig, regions, fixed=belt.astype(int), n_modes=40)
    bent = es.deformation.bend(binding, [ROTATION, es.Translation([0, 0, 0])])
    np.testing.assert_array_equal(found["vertices"], bent.vertices.astype("<f4"))


def test_a_preview_is_exact_and_changes_nothing(page, top):
    page.call("rig", n_modes=None, n_regions=1, fixed=False, _arrays={"region0": top})
    facts, shown = page.call("finish", kind="preview", handles=[PULL], mode="graded")
    bent = es.deform(es.rig_shape(stretched_ball()), top.astype(int), TRANSLATION)
    np.testing.assert_array_equal(shown["vertices"], bent.vertices.astype("<f4"))
    assert facts["state"]["pose"] == 0
    np.testing.assert_array_equal(page.workspace.mesh.vertices, stretched_ball().vertices)


def test_undo_redo_and_reset_restore_the_poses(page, top):
    first = bend(page, top)[1]["vertices"]
    second = bend(page, top, PULL)[1]["vertices"]
    np.testing.assert_array_equal(page.call("finish", kind="undo")[1]["vertices"], first)
    np.testing.assert_array_equal(page.call("finish", kind="redo")[1]["vertices"], second)
    facts, arrays = page.call("finish", kind="reset")
    np.testing.assert_array_equal(arrays["vertices"], stretched_ball().vertices.astype("<f4"))
    assert facts["state"]["deformation"]["n_edits"] == 0
    np.testing.assert_array_equal(page.call("finish", kind="undo")[1]["vertices"], second)
    error = page.error("finish", kind="commit", handles=[PULL], mode="graded")
    assert "A region must be bound" in error["message"]


def test_edits_are_saved_and_replayed_on_another_resolution(page, top):
    bend(page, top)
    edits = json.loads(page.array("file/edits").tobytes())
    page.call("finish", kind="reset")
    again = page.call("finish", kind="replay", edits=edits)[1]["vertices"]
    bent = es.deform(es.rig_shape(stretched_ball()), top.astype(int), ROTATION)
    np.testing.assert_array_equal(again, bent.vertices.astype("<f4"))

    coarse = Page(Workspace(stretched_ball(2)))
    assert coarse.workspace.analysis.rig.wait(600)
    error = coarse.error("finish", kind="replay", edits=edits)
    assert "choose its file together with the edits" in error["message"]
    arrays = {"source": file_of(stretched_ball())}
    found = coarse.call("finish", {"kind": "replay", "edits": edits, "source": "ball.ply"}, arrays)
    assert found[0]["state"]["deformation"]["n_edits"] == 1
    edit = es.deformation.Edit((es.deformation.Move(top.astype(int), ROTATION),))
    rig = es.rig_shape(stretched_ball(2))
    expected = es.deformation.replay(rig, [edit], source=stretched_ball()).mesh
    np.testing.assert_array_equal(found[1]["vertices"], expected.vertices.astype("<f4"))


@pytest.mark.parametrize("suffix", ["ply", "obj", "glb"])
def test_a_file_holds_the_present_pose(page, top, tmp_path, suffix):
    bend(page, top)
    path = tmp_path / f"bent.{suffix}"
    path.write_bytes(page.array(f"file/{suffix}").tobytes())
    single = suffix == "glb"
    expected = (
        page.workspace.mesh.vertices.astype("<f4") if single else page.workspace.mesh.vertices
    )
    np.testing.assert_array_equal(es.read_mesh(path).vertices, expected)


def test_an_opened_file_becomes_the_shape(page):
    ball = es.icosphere(2)
    facts, _ = page.call(
        "finish", {"kind": "open", "name": "a/b\\ball.ply"}, {"file": file_of(ball)}
    )
    state = facts["state"]
    assert (state["name"], state["n_vertices"], state["shape"]) == ("ball.ply", 162, 1)
    np.testing.assert_array_equal(page.array("vertices"), ball.vertices.astype("<f4"))


def test_a_surface_of_freesurfer_is_opened_by_its_name(page, tmp_path):
    es.write_mesh(es.icosphere(2), tmp_path / "lh.pial")
    data = np.frombuffer((tmp_path / "lh.pial").read_bytes(), np.uint8)
    facts, _ = page.call("finish", {"kind": "open", "name": "lh.pial"}, {"file": data})
    assert facts["state"]["n_faces"] == 320
    counts = np.array([162, 320, 1], ">i4").tobytes()
    data = np.frombuffer(b"\xff\xff\xff" + counts + bytes(4 * 162), np.uint8)
    error = page.error("finish", {"kind": "open", "name": "lh.sulc"}, {"file": data})
    assert "Functions on vertices" in error["message"]


def test_opened_points_become_a_surface_and_the_page_is_told(page):
    text = "\n".join(f"{x} {y} {z}" for x, y, z in es.icosphere(3).vertices)
    data = np.frombuffer(text.encode(), np.uint8)
    facts, _ = page.call("finish", {"kind": "open", "name": "ball.xyz"}, {"file": data})
    assert facts["state"]["n_faces"] > 100
    assert any("642 points" in warning for warning in facts["warnings"])


def test_a_repair_is_suggested_and_done():
    ball = es.icosphere(2)
    page = Page(Workspace(es.TriangleMesh(ball.vertices, ball.faces[1:, ::-1])))
    assert page.workspace.analysis.health.wait(600)
    findings = page.call("meta")[0]["health"]["findings"]
    assert [finding["name"] for finding in findings] == ["fill_holes", "orient"]
    facts, _ = page.call("finish", kind="repair", names=["fill_holes", "orient"])
    assert facts["state"]["n_faces"] == 320
    assert len(facts["warnings"]) == 2
    assert page.workspace.analysis.health.wait(600)
    assert page.call("meta")[0]["health"]["closed"]


def test_another_number_of_modes_is_solved_for_and_the_rig_stays(page, top):
    before = page.workspace.analysis.rig.result
    facts, _ = page.call("finish", kind="solve", k=12)
    assert facts["state"]["spectrum"]["status"] == "running"
    assert page.workspace.analysis.spectrum.wait(600)
    assert page.call("meta")[0]["spectrum"]["k"] == 12
    assert page.array("modes").shape == (12, 642)
    bend(page, top)
    assert page.workspace.analysis.rig.result is before


def test_parts_cut_in_the_browser_are_those_of_segment():
    mesh = es.make_creature("quadruped", n_vertices=800)
    page = Page(Workspace(mesh))
    assert "must be ready" in page.error("array", name="parts/labels")["message"]
    page.call("finish", kind="parts")
    assert page.workspace.analysis.parts.wait(600)
    state = page.call("meta")[0]["parts"]
    found = page.workspace.analysis.parts.result
    assert state["n_regions"] == len(found.parts.features.vertices)
    labels, cuts = page.array("parts/labels"), page.array("parts/cuts")
    assert labels.shape == (800,)
    # A row for each number of parts; the last one keeps all the fine parts, whose boundaries are
    # smooth: a part of the tree is cut along them.
    n_fine = len(found.fine.features.vertices)
    assert state["levels"] == [None, *found.tree.persistence[1:n_fine].tolist()]  # null: no end
    np.testing.assert_array_equal(cuts[-1], np.arange(n_fine))
    rough = es.segment(found.tree, n_regions=n_fine).labels
    for row, n_regions in zip(cuts[::-1], range(n_fine, 0, -1), strict=False):
        cut = es.segment(found.tree, n_regions=n_regions)
        np.testing.assert_array_equal(row[rough], cut.labels)
    default = cuts[state["n_regions"] - n_fine - 1]
    np.testing.assert_array_equal(default[found.fine.labels], found.parts.labels)
    assert "labels and cuts" in page.error("array", name="parts/merges")["message"]
    births, deaths, persistence, vertices = page.array("diagram").T
    assert (births >= deaths).all()
    np.testing.assert_allclose(births, found.heat[vertices.astype(int)])
    assert np.isinf(persistence[0])


def test_a_pose_is_transferred_to_another_shape():
    mesh = es.make_creature("quadruped", n_vertices=800)
    page = Page(Workspace(mesh))
    assert page.workspace.analysis.rig.wait(600)
    height = float(np.quantile(mesh.vertices[:, 1], 0.75))
    top = np.flatnonzero(mesh.vertices[:, 1] > height).astype("<u4")
    turn = {"type": "rotation", "pivot": [0, height, 0], "axis": [0, 0, 1], "angle": 0.6}
    bend(page, top, turn)
    expected = 2 * page.workspace.mesh.vertices
    larger = es.TriangleMesh(2 * mesh.vertices, mesh.faces)
    call = {"kind": "transfer", "name": "larger.ply"}
    facts, _ = page.call("finish", call, {"file": file_of(larger)})
    assert (facts["state"]["shape"], facts["state"]["name"]) == (1, "larger.ply")
    # The map carries rotations by its lowest modes, so a tenth of the motion is lost.
    error = np.linalg.norm(page.workspace.mesh.vertices - expected)
    assert error < 0.15 * np.linalg.norm(expected - larger.vertices)


def test_a_file_that_is_opened_leaves_the_shape_before_with_its_edits(page, top):
    bend(page, top)
    bent = page.workspace.mesh.vertices
    tetrahedron = es.TriangleMesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    page.call("finish", {"kind": "open", "name": "t.ply"}, {"file": file_of(tetrahedron)})
    assert page.workspace.mesh.n_vertices == 4
    facts, _ = page.call("finish", kind="choose", shape=0)
    assert facts["state"]["name"] == "ball.ply"
    assert facts["state"]["shapes"] == [[0, "ball.ply"], [1, "t.ply"]]
    assert facts["state"]["deformation"]["n_edits"] == 1
    np.testing.assert_array_equal(page.workspace.mesh.vertices, bent)
    facts, _ = page.call("finish", kind="undo")
    assert (facts["state"]["name"], facts["state"]["shape"]) == ("t.ply", 1)
    assert page.workspace.analysis.rig.wait(600)
    assert page.workspace.analysis.spectrum.status == "ready"  # its jobs go on or begin anew


def test_values_are_shown_with_their_unit():
    mesh = es.icosphere(2)
    page = Page(Workspace(mesh, values={"height (m)": mesh.vertices[:, 2]}))
    (facts,) = page.call("meta")[0]["values"]
    assert (facts["title"], facts["unit"], facts["max"]) == ("height", "m", 1.0)
    shown = page.array(f"values/{facts['name']}")
    np.testing.assert_array_equal(shown, mesh.vertices[:, 2].astype("<f4"))
    with pytest.raises(es.InvalidParameterError, match="one finite number for each"):
        Workspace(mesh, values={"height": [1, 2]})


def test_vertices_without_a_value_stay_without():
    mesh = es.icosphere(2)
    masked = np.where(mesh.vertices[:, 2] > 0.5, np.nan, mesh.vertices[:, 2])
    page = Page(Workspace(mesh, values={"height": masked}))
    (facts,) = page.call("meta")[0]["values"]
    assert (facts["min"], facts["max"]) == (-1, np.nanmax(masked))
    np.testing.assert_array_equal(page.array("values/height"), masked.astype("<f4"))
    nothing, endless = np.full(162, np.nan), np.where(np.isnan(masked), np.inf, masked)
    for bad, said in ((nothing, "0 finite"), (endless, "and 43 infinite")):
        with pytest.raises(es.InvalidParameterError, match=said):
            Workspace(mesh, values={"height": bad})


def test_an_index_is_searched(tmp_path):
    fish, bird = (es.make_creature(kind, n_vertices=500) for kind in ("fish", "bird"))
    index = es.ShapeIndex.create(tmp_path / "index")
    es.write_mesh(fish, tmp_path / "fish.ply")
    index.add("fish", fish, label="animal", source=str(tmp_path / "fish.ply"), n_views=0)
    index.add("bird", bird, n_views=0)
    page = Page(Workspace(es.make_creature("fish", 1, n_vertices=500), index=tmp_path / "index"))
    assert page.call("meta")[0]["index"]["n_shapes"] == 2
    facts, arrays = page.call("query", n_matches=2)
    assert [match["name"] for match in facts["matches"]] == ["fish", "bird"]
    assert arrays["thumbnail0"].tobytes().startswith(b"\x89PNG")
    assert facts["matches"][0]["up"] == [0, 1, 0]
    assert "thumbnail1" not in arrays
    assert "up" not in facts["matches"][1]
    assert arrays["pairs0"].max() < 500
    np.testing.assert_array_equal(page.array("match/0/faces"), fish.faces)
    # The shape itself, and a part
    assert page.call("finish", kind="open", match=0)[0]["state"]["name"] == "fish"
    facts, arrays = page.call("query", n_matches=2)
    assert facts["itself"] == "fish"
    assert [match["name"] for match in facts["matches"]] == ["bird"]
    head = np.flatnonzero(fish.vertices[:, 2] > np.median(fish.vertices[:, 2])).astype("<u4")
    facts, arrays = page.call("query", {"n_matches": 1}, {"region": head})
    assert np.isin(arrays["pairs0"].reshape(-1, 2)[:, 0], head).all()
    assert (
        "paint a larger one"
        in page.error("query", {"n_matches": 1}, {"region": head[:1]})["message"]
    )
    call = {"n_matches": 1, "name": "bird.ply"}
    facts, _ = page.call("query", call, {"file": file_of(bird)})
    assert facts["matches"][0]["name"] == "bird"
    assert facts["warnings"] == []
    assert "without its file" in page.error("finish", kind="open", match=0)["message"]


def test_two_tabs_share_the_analysis_and_nothing_else(page, top):
    other = Page(page.workspace.fork())
    bend(page, top)
    np.testing.assert_array_equal(other.workspace.mesh.vertices, stretched_ball().vertices)
    assert other.call("meta")[0]["pose"] == 0
    assert other.workspace.analysis.rig is page.workspace.analysis.rig
    other.call("finish", kind="open", name="b.ply", _arrays={"file": file_of(es.icosphere(1))})
    assert page.call("meta")[0]["n_vertices"] == 642


WRONG = [
    ("rig", {"n_regions": 5}, {}, "n_regions must be a whole number in 1..4"),
    ("rig", {"n_regions": True}, {}, "n_regions must be"),
    ("rig", {"n_regions": 1}, {}, "region0 is missing"),
    ("rig", {"n_regions": 1}, {"region0": [9999]}, "must lie in 0..641"),
    ("rig", {"n_regions": 1}, {"region0": []}, "must have a boundary"),
    ("finish", {"kind": "explode"}, {}, "kind must be one of"),
    ("finish", {"kind": ["undo"]}, {}, "kind must be one of"),
    ("finish", {"kind": "undo"}, {}, "an edit to undo"),
    ("finish", {"kind": "commit"}, {}, "must be bound"),
    ("finish", {"kind": "solve", "k": 0}, {}, "k must be a whole number"),
    ("finish", {"kind": "repair", "names": ["explode"]}, {}, "must be among"),
    ("finish", {"kind": "repair"}, {}, "must be a list"),
    ("finish", {"kind": "open", "name": "a.ply"}, {}, "with the bytes of a file"),
    ("finish", {"kind": "open", "name": "a.exe"}, {"file": b"MZ"}, "must end in .off"),
    ("finish", {"kind": "open", "name": "a.ply"}, {"file": b"ply"}, "The file"),
    ("finish", {"kind": "replay", "edits": {"kind": "x"}}, {}, "of kind"),
    ("finish", {"kind": "open", "match": 0}, {}, "match must be a whole number"),
    ("array", {"name": "nothing"}, {}, "must be an array of the requested name"),
    ("array", {"name": 3}, {}, "must be text"),
    ("array", {"name": "file/../../etc/passwd"}, {}, "must be ply"),
    ("array", {"name": "values/x"}, {}, "Values must be among"),
    ("array", {"name": "skeleton/9999999999"}, {}, "of 1 to 300 modes"),
    ("array", {"name": "modes", "start": 5, "stop": 4}, {}, "stop must be"),
    ("query", {"n_matches": 3}, {}, "must be an index"),
    ("explode", {}, {}, "must be one of meta"),
]


@pytest.mark.parametrize(("call", "meta", "arrays", "reason"), WRONG)
def test_a_wrong_call_is_answered_with_its_reason(page, call, meta, arrays, reason):
    given = {
        name: np.frombuffer(value, "|u1") if isinstance(value, bytes) else np.array(value, "<u4")
        for name, value in arrays.items()
    }
    assert reason in page.error(call, meta, given)["message"]
    assert page.call("meta")[0]["shape"] == 0


HANDLES = [
    [],
    {},
    [3],
    [{"type": "rotation"}],
    [{"type": "scale"}],
    [{**TURN, "axis": [0, 0, 0]}],
    [{**TURN, "pivot": "here"}],
    [{**TURN, "angle": None}],
    [{"type": "translation", "vector": [1e999, 0, 0]}],
    [{"type": "translation", "vector": [[1, 2], 3]}],
    [{"type": "scaling", "pivot": [0, 0, 0]}],
    [{"type": "scaling", "pivot": [0, 0, 0], "factors": [1, 0, 1]}],
]


@pytest.mark.parametrize("handles", HANDLES)
def test_a_wrong_handle_is_refused(page, top, handles):
    page.call("rig", n_modes=None, n_regions=1, fixed=False, _arrays={"region0": top})
    page.error("finish", kind="commit", handles=handles, mode="graded")
    assert page.call("meta")[0]["deformation"]["n_edits"] == 0


def test_a_message_that_is_none_is_answered():
    workspace = Workspace(es.icosphere(1))
    for message in (b"", b"nonsense", encode([1, 2])):
        answer = workspace.answer("meta", message)
        assert answer.status == 400
        assert "error" in decode(answer.message)[0]


@pytest.mark.parametrize("up", ["y", "-z", "x", [0.0, 1.0, 1.0]])
@pytest.mark.parametrize("view", ["auto", "front", "right", "top", "bottom", [1.0, 2.0, 3.0]])
def test_the_page_looks_from_the_requested_side(view, up):
    """Its camera stands upright, as that of a figure does: right is up x towards."""
    ball = es.icosphere(2)
    workspace = Workspace(ball)
    workspace.analysis.look_from(view, up)
    found = workspace.analysis.view()
    right = np.cross(found["up"], found["towards"])
    camera = es.plot.aim_camera(ball, view=view, up=up)
    assert right / np.linalg.norm(right) == pytest.approx(camera.rotation[0], abs=1e-9)
    assert found["towards"] == pytest.approx(camera.rotation[2], abs=2e-3)  # not along `up`
    workspace.close()


def test_a_repair_does_not_turn_the_shape():
    workspace = Workspace(stretched_ball())
    workspace.analysis.look_from("left", "z")
    before = workspace.state()
    workspace.answer("finish", encode({"kind": "repair", "names": ["orient"]}))
    after = workspace.state()
    assert after["shape"] == before["shape"] + 1
    assert (after["up"], after["towards"]) == (before["up"], before["towards"])
    workspace.close()


@pytest.mark.parametrize("side", [("behind", "auto"), ("auto", "w"), ([0, 0, 0], "y")])
def test_a_side_that_is_none_is_refused(side):
    workspace = Workspace(es.icosphere(1))
    with pytest.raises(es.InvalidParameterError, match="must be"):
        workspace.analysis.look_from(*side)
    workspace.close()


def test_a_file_that_is_saved_keeps_what_the_opened_one_held(tmp_path):
    ball = es.icosphere(2)
    colors = np.arange(3 * ball.n_vertices, dtype=np.uint8).reshape(-1, 3)
    es.write_mesh(ball, tmp_path / "a.glb", colors=colors)
    mesh, attributes = es.read_mesh(tmp_path / "a.glb", attributes=True)
    workspace = Workspace([Shape(0, "a.glb", lambda: Loaded(mesh, attributes))])
    for kind in ("glb", "ply"):
        path = tmp_path / f"b.{kind}"
        path.write_bytes(workspace._file(kind).tobytes())
        assert es.read_mesh(path, attributes=True)[1].colors is not None
    workspace.close()


@pytest.mark.parametrize("suffix", [".gii", ".vtu"])
def test_functions_of_the_file_are_there_to_choose_from(tmp_path, suffix):
    ball = es.icosphere(2)
    fields = {
        "height (mm)": ball.vertices[:, 2],
        "hole": np.full(162, np.nan),
        "move": ball.vertices,
    }
    es.io.write_fields(ball, tmp_path / f"a{suffix}", fields)
    workspace = open_workspace([tmp_path / f"a{suffix}"])
    assert [facts["name"] for facts in workspace.state()["values"]] == ["height (mm)"]
    workspace.close()


def textured_ball():
    """Return a ball that is cut open where a texture begins, and its attributes: two materials."""
    ball = es.icosphere(2)
    right = ball.vertices[ball.faces].mean(axis=1)[:, 0] > 0
    halves = [submesh(ball, half)[0] for half in (right, ~right)]
    cut = es.geometry.disjoint_union(*halves)
    corners = cut.vertices[cut.faces]
    none = np.full(cut.n_faces, -1)
    attributes = es.io.MeshAttributes(
        cut,
        eye_array(3 * cut.n_faces, format="csr"),
        none + 1,
        np.repeat([0, 1], [half.n_faces for half in halves]),
        none,
        texture_coordinates=corners[:, :, :2] / 2 + 0.5,
        materials=(
            es.io.Material("skin", image=IMAGE, image_name="skin.png"),
            es.io.Material("red", color=(1.0, 0.0, 0.0, 1.0)),
        ),
    )
    return cut, attributes


def require_skin(page, places):
    """Check what the page draws against the texture: half of the ball has the image, half is red."""
    rows, corners = page.array("skin/rows"), page.array("skin/corners").reshape(-1, 3)
    faces = page.array("faces").reshape(-1, 3)
    np.testing.assert_array_equal(rows[corners, 0], faces)
    np.testing.assert_allclose(rows[corners, 1:3], places, atol=1e-6)
    has_image = rows[corners, 6] == 1
    assert (has_image == has_image[:, :1]).all()
    assert 0 < has_image.sum() < has_image.size
    np.testing.assert_array_equal(np.unique(rows[corners][has_image][:, 3:6], axis=0), [[255] * 3])
    np.testing.assert_array_equal(
        np.unique(rows[corners][~has_image][:, 3:6], axis=0), [[255, 0, 0]]
    )
    assert page.array("skin/0").tobytes() == IMAGE
    # The corners of a vertex on the border of both look different, so it is split there.
    assert len(rows) > page.workspace.mesh.n_vertices


def test_a_textured_file_is_joined_shown_and_saved_with_its_texture(tmp_path):
    cut, attributes = textured_ball()
    es.write_mesh(cut, tmp_path / "ball.glb", attributes=attributes)
    workspace = open_workspace([tmp_path / "ball.glb"])
    page = Page(workspace)
    state = workspace.state()
    assert (state["n_vertices"], state["n_images"]) == (162, 1)
    n_double = cut.n_vertices - 162
    assert state["notes"] == [f"weld_seams joined {n_double} vertices along seams"]
    require_skin(page, attributes.texture_coordinates)
    assert "There are 1 images; '1' is none" in page.error("array", name="skin/1")["message"]
    (tmp_path / "again.glb").write_bytes(page.array("file/glb").tobytes())
    _, kept = es.read_mesh(tmp_path / "again.glb", attributes=True)
    np.testing.assert_allclose(kept.texture_coordinates, attributes.texture_coordinates, atol=1e-6)
    assert kept.materials[0].image == IMAGE
    workspace.close()


def test_a_textured_file_may_be_dropped(page, tmp_path):
    cut, attributes = textured_ball()
    es.write_mesh(cut, tmp_path / "ball.glb", attributes=attributes)
    data = np.frombuffer((tmp_path / "ball.glb").read_bytes(), np.uint8)
    facts, _ = page.call("finish", {"kind": "open", "name": "ball.glb"}, {"file": data})
    assert facts["state"]["n_images"] == 1
    assert any("weld_seams joined" in warning for warning in facts["warnings"])
    require_skin(page, attributes.texture_coordinates)


def test_colors_of_a_file_are_a_skin_without_an_image(tmp_path):
    ball = es.icosphere(1)
    colors = np.arange(3 * ball.n_vertices, dtype=np.uint8).reshape(-1, 3)
    es.write_mesh(ball, tmp_path / "a.ply", colors=colors)
    workspace = open_workspace([tmp_path / "a.ply"])
    assert workspace.state()["n_images"] == 0
    rows = Page(workspace).array("skin/rows")
    np.testing.assert_array_equal(rows[:, 3:6], colors[rows[:, 0].astype(int)])
    workspace.close()


def test_what_has_no_look_has_no_skin(page):
    assert page.workspace.state()["n_images"] == -1
    error = page.error("array", name="skin/rows")["message"]
    assert "must hold colors or a texture; it does not" in error


def test_an_island_of_a_region_is_told_when_it_is_bound(page, top):
    away = es.geometry.geodesic_distances(page.workspace.mesh, [top])[0]
    island = np.flatnonzero((away > 0.3) & (away < 0.4))[:1]
    regions = {"region0": np.union1d(top, island).astype("<u4")}
    facts, _ = page.call("rig", {"n_modes": None, "n_regions": 1, "fixed": False}, regions)
    assert f"of which vertex {island[0]} follows by 0." in facts["warnings"][0]
    facts, _ = page.call("rig", {"n_modes": None, "n_regions": 1, "fixed": False}, {"region0": top})
    assert facts["warnings"] == []
