"""Numbers that no call can use are refused by name: NaN, infinity, negative ones, one where several are needed."""

import subprocess
import sys

import numpy as np
import pytest

import eigenshape as es

BALL = es.icosphere(2)
HEIGHTS = BALL.vertices[:, 1]
LAPLACIAN = es.cotangent_laplacian(BALL)
SPECTRUM = es.solve_spectrum(LAPLACIAN, 9)
TREE = es.merge_tree(BALL, HEIGHTS)

CALLS = {
    "persistence": lambda: es.plot.figure_merge_tree(TREE, persistence=np.nan),
    "area": lambda: es.plot.figure_spectrum(SPECTRUM, area=-1.0),
    "least_curvature": lambda: es.stability.cheeger_estimate(
        BALL, SPECTRUM, least_curvature=np.nan
    ),
    "ratio": lambda: es.spectral.separated_groups([0.0, 1.0, 2.0], ratio=np.inf),
    "values": lambda: es.calculus.solve_heat(LAPLACIAN, HEIGHTS, 0.1, values=1.0),
    "power": lambda: es.spectral.spectral_embedding(SPECTRUM, power=1e12),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_number_that_cannot_be_used_is_named(name):
    with pytest.raises(es.InvalidParameterError, match=rf"^{name} "):
        CALLS[name]()


def test_one_number_where_several_are_needed_is_named(tmp_path):
    # In a process of its own: the type checks of these tests would speak before ours.
    calls = {
        "limits": "es.plot.figure_field(ball, ball.vertices[:, 1], limits=0.5)",
        "part": "es.io.find_items('.', part=3)",
        "n_vertices": "es.geometry.unmask([1.0], [0], float('nan'))",
        "colors": "es.write_mesh(ball, 'unwritten.ply', colors=1)",
        "face_labels": "es.write_mesh(ball, 'unwritten.ply', face_labels=1)",
    }
    script = [
        "import eigenshape as es",
        "ball = es.icosphere(2)",
        "es.write_mesh(ball, 'ball.ply')",
    ]
    for call in calls.values():
        script += [
            "try:",
            f"    {call}",
            "except es.InvalidParameterError as err:",
            "    print(err)",
        ]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(calls)
    assert [path.name for path in tmp_path.iterdir()] == ["ball.ply"]


def test_a_seed_must_be_a_whole_number():
    patches = es.retrieval.extract_patches(es.icosphere(3), n_views=0)
    with pytest.raises(es.InvalidParameterError, match="seed must be at least 0"):
        es.retrieval.train_codebook(patches, seed=-1)


def test_a_level_that_no_tetrahedron_crosses_gives_an_empty_set():
    box = es.shapes.box(2, 2, 2)
    assert es.calculus.level_set(box, box.points[:, 0], 9.0).size == 0
