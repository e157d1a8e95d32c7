"""`eigenshape segment`, and the colors that `eigenshape features` writes."""

import numpy as np
import pytest
from running import run, run_json

from eigenshape.features.parts import find_parts
from eigenshape.features.segmentation import segment
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.plot.fields import part_colors
from eigenshape.shapes.creatures import make_creature

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def biped(tmp_path_factory):
    path = tmp_path_factory.mktemp("biped") / "biped.ply"
    write_mesh(make_creature("biped", n_vertices=1200), path)
    return path


def colors_in(path):
    """Read the colors of a binary PLY file by its own header."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    assert b"property uchar red\nproperty uchar green\nproperty uchar blue" in head
    n = int(head.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(body, dtype=[("xyz", "<f8", 3), ("rgb", "u1", 3)], count=n)["rgb"]


@pytest.mark.long
def test_segment_gives_the_default_parts(biped, tmp_path):
    colored, picture = tmp_path / "parts.ply", tmp_path / "parts.png"
    found = run_json("segment", biped, "-o", colored, "--picture", picture)
    mesh = read_mesh(biped)
    expected = find_parts(mesh).parts
    assert found["method"] == "parts"
    assert found["face_labels"] == expected.labels.tolist()
    assert sum(row["area_share"] for row in found["parts"]) == pytest.approx(1)
    assert max(row["area_share"] for row in found["parts"]) < 0.5
    assert sum(row["faces"] for row in found["parts"]) == mesh.n_faces
    assert [row["splits_from"] is None for row in found["parts"]] == [True] + [False] * (
        len(found["parts"]) - 1
    )
    assert all(row["splits_from"] < row["part"] for row in found["parts"][1:])
    assert picture.read_bytes()[:8] == PNG
    assert np.array_equal(read_mesh(colored).vertices, mesh.vertices)
    assert np.array_equal(colors_in(colored), part_colors(mesh, expected.labels))


@pytest.mark.long
def test_segment_cuts_where_it_is_told(biped):
    assert len(run_json("segment", biped, "-n", 3)["parts"]) == 3
    one = run_json("segment", biped, "--persistence", 2)
    assert len(one["parts"]) == 1
    assert one["parts"][0]["persistence"] is None
    finer = run_json("segment", biped, "--level", 1)["parts"]
    assert len(finer) == len(run_json("segment", biped, "--persistence", 0.15)["parts"])
    assert len(finer) > len(run_json("segment", biped)["parts"])
    every = run_json("segment", biped, "--persistence", 0)
    assert len(every["parts"]) == len(find_parts(read_mesh(biped)).tree.maxima)
    lengths = [row["persistence"] for row in every["parts"][1:]]
    widest = int(np.argmax(np.subtract(lengths, [*lengths[1:], 0])))
    assert len(run_json("segment", biped, "--largest-gap")["parts"]) == widest + 2


@pytest.mark.long
def test_segment_smooths_parts_and_leaves_regions_of_heat_as_they_are(biped):
    rough = run_json("segment", biped, "--no-smooth")["face_labels"]
    assert rough == segment(find_parts(read_mesh(biped)).tree, persistence=0.3).labels.tolist()
    assert rough != run_json("segment", biped)["face_labels"]
    thesis = run_json("segment", biped, "--method", "thesis")
    assert len(thesis["parts"]) == 15
    features = run_json("features", biped, "--method", "thesis")
    assert thesis["face_labels"] == features["face_labels"]
    assert (
        thesis["face_labels"]
        != run_json("segment", biped, "--method", "thesis", "--smooth")["face_labels"]
    )


def test_segment_prints_a_table(biped):
    text = run("segment", biped).stdout
    for word in ("splits from", "never merges", "feature point", "none"):
        assert word in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("segment", "{missing}", "-o", "a.off"),
            "A mesh with labels must be written to a file that ends in .obj, .ply, .glb, .seg, .txt; a.off ends",
        ),
        (
            ("segment", "{missing}", "-o", "{missing}/a.ply"),
            "A mesh with labels must be written to a folder",
        ),
        (("segment", "{missing}", "--picture", "a.bmp"), "A picture must end in"),
        (
            ("features", "{missing}", "-o", "a.off"),
            "A mesh with colors must be written to a file that ends in .obj, .ply, .glb; ",
        ),
        (
            ("segment", "{mesh}", "--level", 1, "-n", 3),
            "at most one of --n-parts, --persistence, --largest-gap, --level; it was given --n-parts and",
        ),
        (
            ("segment", "{mesh}", "--level", 1, "--method", "thesis"),
            "--level is for --method parts; the method is thesis",
        ),
        (("segment", "{mesh}", "--level", "inf"), "--level must be finite; it is inf"),
        (
            ("segment", "{mesh}", "-n", 3, "--largest-gap"),
            "it was given --n-parts and --largest-gap",
        ),
        (
            ("features", "{mesh}", "--persistence", 1, "--largest-gap"),
            "it was given --persistence and --largest-gap",
        ),
        (("segment", "{mesh}", "--persistence", -1), "persistence must be at least 0"),
    ],
)
def test_segment_refuses_before_it_works(biped, tmp_path, arguments, message):
    filled = [str(word).format(missing=tmp_path / "missing", mesh=biped) for word in arguments]
    done = run(*filled, code=2)
    assert message in " ".join(done.stderr.split())
    assert done.stdout == ""


@pytest.mark.parametrize("verb", ["segment", "features"])
def test_a_number_of_parts_below_one_is_refused_by_the_name_of_the_option(biped, verb):
    shown = run(verb, biped, "-n", 0, code=2).output
    assert "--n-parts" in shown
    assert "n_regions" not in shown


def test_features_write_their_heat_as_colors(biped, tmp_path):
    path = tmp_path / "heat.ply"
    run("features", biped, "-o", path)
    colors = colors_in(path)
    assert len(np.unique(colors, axis=0)) > 50
    hottest = run_json("features", biped)["features"][0]["vertex"]
    assert tuple(colors[hottest]) == (253, 231, 37), "the highest color of viridis"
