"""The exchange with other programs: what is compared of two readings, and how a difference is judged."""

import copy
import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def interop():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import bench_interop

        yield bench_interop
    finally:
        sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def shapes(interop):
    return interop.make_shapes()


def test_every_shape_equals_itself_and_its_triangles(interop, shapes):
    for shape in shapes.values():
        truth = shape.get("truth", shape)
        assert interop.compare(truth, truth) == {}
        if "triangles" in shape and "cell_fields" not in shape and "texture" not in shape:
            cut = truth | {"polygons": truth["triangles"]}
            assert interop.compare(truth, cut) == {}


def test_fans_of_polygons_differ_in_area(interop, shapes):
    prism = shapes["prism"]
    fans = [[f[0], f[i], f[i + 1]] for f in prism["polygons"] for i in range(1, len(f) - 1)]
    assert interop.compare(prism, prism | {"polygons": fans})["area"] == "15 for 14"


def test_what_is_lost_or_changed_is_found(interop, shapes):
    colors = copy.deepcopy(shapes["colors"])
    colors["colors"][3][0] ^= 128
    assert list(interop.compare(shapes["colors"], colors)) == ["colors"]
    seam = {key: value for key, value in shapes["seam"].items() if key != "texture"}
    assert interop.compare(shapes["seam"], seam) == {"texture": "none"}
    fields = copy.deepcopy(shapes["fields"])
    fields["point_fields"]["mask"]["values"][0] ^= True
    del fields["point_fields"]["is seen"]
    fields["cell_fields"]["part"]["values"][0] = 9
    found = interop.compare(shapes["fields"], fields)
    assert list(found) == ["field mask", "field is seen", "field part"]


def test_a_skin_left_undone_is_not_named_by_what_is_only_kept(interop):
    kept = "a.glb: only a file of the same format keeps skins"
    assert not interop.is_named("coordinates", [kept])
    assert interop.is_named("coordinates", ["a.glb: its skin is not applied"])
    assert not interop.is_named("colors", ["keeps properties other than color and image"])
    assert not interop.is_named("field part", ["a.ply does not keep: the field 'label'."])
    assert interop.is_named("field part", ["a.ply does not keep: the field 'part'."])


def test_witnesses_decide_whose_difference_it_is(interop, shapes, tmp_path):
    exchange = object.__new__(interop.Exchange)
    exchange.shapes, exchange.missed = shapes, {}
    exchange.about, exchange.compared = {"trimesh": {}, "blender": {}}, {}
    path = tmp_path / "colors.ply"
    gray = {key: value for key, value in shapes["colors"].items() if key != "colors"}
    interop.write_here(shapes["colors"], path)
    exchange.found = {
        (path, "trimesh"): {"found": gray},
        (path, "blender"): {"found": shapes["colors"]},
    }
    written = interop.Written(path, "colors", [], "")
    judged = interop.judge_writing(exchange, written, "trimesh")
    assert judged == "theirs: colors none, and right in Blender"
    assert interop.judge_writing(exchange, written, "trimesh", {"colors"}) == "equal"
    assert interop.judge_writing(exchange, written, "blender") == "equal"
    refused = written._replace(error="No colors. Leave them out.")
    assert interop.judge_writing(exchange, refused, "blender") == "named: No colors"
    assert interop.judge_reading(exchange, path, "trimesh", "colors") == "equal"
    interop.write_here(gray, path)  # as a program that keeps no colors would
    assert interop.judge_reading(exchange, path, "trimesh", "colors").startswith(
        "SILENT: colors none"
    )
    exchange.found[path, "blender"], exchange.compared = {"found": gray}, {}
    assert interop.judge_reading(exchange, path, "trimesh", "colors").startswith(
        "theirs: colors none"
    )


def test_formats_with_the_same_results_share_a_row(interop):
    row = {"tool": "meshio", "version": "5", "way": "read", "shape": "far", "result": "equal"}
    named = {"format": "VTU", "shape": "prism", "result": "named: no polygons"}
    rows = [row | {"format": form} for form in ("VTU", "VTK")]
    assert interop.table(rows) == [["meshio 5", "VTU; VTK", "read here", "far", ""]]
    (_, *cells), _ = interop.table([*rows, row | named])
    assert cells == ["VTU", "read here", "far", "*prism*: no polygons (named)"]


@pytest.mark.skipif(find_spec("meshio") is None, reason="meshio is not installed.")
def test_the_script_runs(tmp_path):
    report = tmp_path / "report.json"
    command = [
        sys.executable,
        BENCHMARKS / "bench_interop.py",
        "--tools",
        "meshio",
        "--json",
        report,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    figures = json.loads(report.read_text())
    assert "results:" in done.stdout
    assert len(figures["rows"]) > 30
    kinds = {row["result"].partition(":")[0] for row in figures["rows"]}
    assert kinds <= {"equal", "named", "theirs", "SILENT"}
    assert (done.returncode == 0) == ("SILENT" not in kinds)
