import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.long
@pytest.mark.sweep
def test_main_road_finds_the_octopus(tmp_path):
    example = runpy.run_path(str(ROOT / "examples" / "main_road.py"))
    matches = example["main"](tmp_path, n_vertices=1000)
    assert [match.label for match in matches] == ["octopus"] * 3
    assert all(len(match.correspondences) for match in matches)
    assert matches[0].score <= matches[1].score <= matches[2].score


@pytest.mark.long
def test_a_noisy_scan_is_found(tmp_path):
    best, second, other = runpy.run_path(str(ROOT / "examples" / "find_a_scan.py"))["main"](
        tmp_path, n_vertices=1000
    )
    assert [best.label, second.label] == ["octopus"] * 2
    assert best.score < second.score < other.score
    assert len(best.correspondences) > 10


@pytest.mark.long
def test_a_bent_shape_is_bent_again_on_a_finer_mesh(tmp_path):
    poses = runpy.run_path(str(ROOT / "examples" / "bend_a_shape.py"))["main"](
        tmp_path, n_vertices=1200
    )
    made, nodding, lifted, finer = (
        poses[name].vertices for name in ("as made", "nodding", "lifted", "again, finer")
    )
    assert nodding[:, 1].max() < made[:, 1].max() - 0.05
    assert np.abs(lifted - nodding).max() > 0.05
    np.testing.assert_allclose(finer[: len(made)], lifted, atol=0.03)
    assert (tmp_path / "giraffe.png").stat().st_size > 10_000


def test_a_shape_is_filtered_measured_and_clustered():
    found = runpy.run_path(str(ROOT / "examples" / "filter_and_cluster.py"))["main"]()
    assert found["mean error of 25 modes, shares of the diagonal"] < 0.03
    assert found["volume kept"] == pytest.approx(1, rel=1e-9)
    assert 0.2 < found["points in the largest cluster"] < 0.8


def test_any_shape_has_its_spectrum(capsys):
    spectra = runpy.run_path(str(ROOT / "examples" / "any_shape.py"))["main"]()
    np.testing.assert_allclose(spectra["sphere"], [0, 2, 2, 2], atol=0.02)
    np.testing.assert_allclose(spectra["points"], [0, 2, 2, 2], atol=0.05)
    np.testing.assert_allclose(
        spectra["interval"], [0, np.pi**2, 4 * np.pi**2, 9 * np.pi**2], rtol=0.002, atol=1e-9
    )
    assert "All 11 laws hold." in capsys.readouterr().out


@pytest.mark.long
def test_calculus_on_a_shape_draws_its_pictures(tmp_path):
    found = runpy.run_path(str(ROOT / "examples" / "calculus_on_a_shape.py"))["main"](
        tmp_path, n_vertices=800
    )
    assert found["up"].min() == 0.0
    assert found["up"].max() == 1.0
    assert (found["girths"] > 0).all()
    assert found["distortion"].mean() < 1.1
    page = (ROOT / "docs" / "calculus.md").read_text()
    shown = re.findall(r"\(pictures/(\S+?)\)", page)
    assert sorted(shown) == sorted(path.name for path in tmp_path.glob("*.png"))


def test_a_mark_survives_a_small_file(tmp_path, capsys):
    test = runpy.run_path(str(ROOT / "examples" / "small_and_marked.py"))["main"](tmp_path)
    assert test.false_alarm < 1e-30
    assert "bits a vertex, faces included" in capsys.readouterr().out


def test_heat_is_drawn_and_a_torus_recovered(tmp_path):
    example = runpy.run_path(str(ROOT / "examples" / "heat.py"))
    found = example["main"](tmp_path)
    area = es.geometry.surface_area(es.shapes.torus(36, 18))
    assert abs(found.area - area) < max(found.area_error, 0.005 * area)
    assert found.whole_characteristic(even=True) == 0
    assert (tmp_path / "heat.png").stat().st_size > 10_000


def test_readme_begins_with_exactly_two_commands():
    blocks = (ROOT / "README.md").read_text().split("```")
    commands = blocks[1].splitlines()[1:]
    assert len([line for line in commands if line.strip()]) == 2


@pytest.mark.long
def test_two_groups_differ_in_the_left_arm():
    found = runpy.run_path(str(ROOT / "examples" / "where_groups_differ.py"))["main"]()
    region, places = found["region"], found["vertices"]
    assert places[region > 0.5 * region.max(), 0].min() > 0.2  # no other limb is there
    scores = found["scores"] * np.sign(found["scores"][-1])
    assert scores[:3].max() < 0 < scores[3:].min()


def test_every_example_has_a_test():
    tested = Path(__file__).read_text()
    examples = sorted((ROOT / "examples").glob("*.py"))
    assert examples
    assert all(example.name in tested for example in examples)


@pytest.mark.long
def test_noise_moves_points_little_and_a_pose_eigenvalues_little(tmp_path):
    reports = runpy.run_path(str(ROOT / "examples" / "how_stable.py"))["main"](tmp_path)
    noisy, posed = reports["noisy"], reports["posed"]
    assert noisy.delta < 0.1 * posed.delta
    assert posed.spectra.median_relative < 0.5 * noisy.spectra.median_relative
    assert not noisy.times.empty
    assert posed.times.empty
    assert (tmp_path / "posed.png").stat().st_size > 10_000


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_front_page_can_be_drawn(tmp_path):
    drawn = runpy.run_path(str(ROOT / "examples" / "front_page.py"))["main"](
        tmp_path, n_vertices=800
    )
    readme = (ROOT / "README.md").read_text()
    # Those of the studio are drawn, and tested, with the studio.
    shown = re.findall(r"\(docs/pictures/(?!studio_)(\S+?)\)", readme)
    assert shown == [path.name for path in drawn]
    assert all(path.stat().st_size > 10_000 for path in drawn)


@pytest.mark.long
def test_ways_on_a_shape_agree(tmp_path):
    found = runpy.run_path(str(ROOT / "examples" / "ways_on_a_shape.py"))["main"](tmp_path)
    assert found["by heat"] == pytest.approx(found["by waves"], rel=0.05)
    assert found["along the path"] >= 0.98 * found["by waves"]
    assert found["length of a vector"] == pytest.approx(1.0)
    shares = [found[f"{part} share"] for part in ("exact", "coexact", "harmonic")]
    assert sum(shares) == pytest.approx(1.0)
    assert shares[2] < 1e-20  # a giraffe is a sphere
    assert (tmp_path / "distances.png").stat().st_size > 10_000
