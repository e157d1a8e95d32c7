"""How two scans are placed on each other, step by step."""

import numpy as np
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.matching import registration
from eigenshape.matching.registration import Registration, describe_scan, register_described


def test_candidates_for_a_motion_do_not_depend_on_the_unit_of_length():
    mesh = es.make_creature("quadruped", 1, n_vertices=800)
    scans = [
        es.partial_scan(mesh, direction).mesh for direction in ([1, 0.2, 0.3], [0.8, -0.4, 0.3])
    ]

    def motions(size):
        one, two = (
            describe_scan(es.TriangleMesh(size * each.vertices, each.faces)) for each in scans
        )
        return registration._find_motions(one, two, max(one.size, two.size))

    found = motions(1.0)
    assert len(found) > 3
    for size in (0.01, 100.0):
        again = motions(size)
        assert len(again) == len(found)
        for one, other in zip(found, again, strict=True):
            np.testing.assert_allclose(other.rotation, one.rotation, atol=1e-9)
            np.testing.assert_allclose(other.translation, size * one.translation, atol=1e-9 * size)


def test_motions_that_lead_to_one_place_are_refined_once(monkeypatch):
    scan = describe_scan(es.icosphere(3))
    nearly = Rotation.from_rotvec([0, 0, 0.01]).as_matrix()
    turned = Rotation.from_rotvec([0, 0, 1.0]).as_matrix()
    moves = {
        "first": (np.eye(3), np.zeros(3)),
        "nearly the same": (nearly, np.array([0.01, 0, 0])),
        "elsewhere": (np.eye(3), np.array([1.0, 0, 0])),
        "turned": (turned, np.zeros(3)),
    }
    motions = [Registration(*move, score=0.0) for move in moves.values()]
    refined = []
    monkeypatch.setattr(registration, "_find_motions", lambda *_: list(motions))
    monkeypatch.setattr(registration, "_rate", lambda *_: 0.0)
    monkeypatch.setattr(
        registration, "_refine", lambda one, two, motion, unit: refined.append(motion) or motion
    )
    register_described(scan, scan)
    names = [name for name, motion in zip(moves, motions, strict=True) if motion in refined]
    assert names == ["first", "elsewhere", "turned"]
    assert len(refined) == 3
