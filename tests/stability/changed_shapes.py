"""Shapes changed by surgery."""

import numpy as np

import eigenshape as es


def bumped(height=0.2, level=2):
    """A sphere whose north cap was raised and split: faces of the cap are dropped, finer ones added."""
    mesh = es.icosphere(level)
    cap = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > 0.8
    old, new = mesh.faces[cap], []
    middles = np.array([mesh.vertices[face].mean(axis=0) * (1 + height) for face in old])
    for place, (a, b, c) in enumerate(old):
        top = mesh.n_vertices + place
        new += [[a, b, top], [b, c, top], [c, a, top]]
    other = es.TriangleMesh(
        np.concatenate([mesh.vertices, middles]), np.concatenate([mesh.faces[~cap], new])
    )
    labels = np.where(np.arange(other.n_faces) < (~cap).sum(), -1, 0)
    return mesh, other, np.where(cap, 0, -1), labels


def handled(level=3):
    """A sphere, and the same with two discs of a cap cut out and a tube between: another topology in region 0."""
    mesh = es.icosphere(level)
    cap = mesh.vertices[mesh.faces].min(axis=1)[:, 2] > 0.6
    wanted = np.array([[0.25, 0.0, 1.0], [-0.25, 0.0, 1.0]])
    ends = [int(np.argmax(mesh.vertices @ direction)) for direction in wanted]
    gone = np.isin(mesh.faces, ends).any(axis=1)
    rims = [_rim(mesh, end) for end in ends]
    if len(rims[0]) != len(rims[1]):
        raise AssertionError
    k = len(rims[0])
    two = np.roll(rims[1][::-1], 1)
    starts = [np.roll(two, turn) for turn in range(k)]
    apart = [
        np.linalg.norm(mesh.vertices[rims[0]] - mesh.vertices[start], axis=1).sum()
        for start in starts
    ]
    one, two = rims[0], starts[int(np.argmin(apart))]
    tube = [[one[i], one[(i + 1) % k], two[i]] for i in range(k)]
    tube += [[one[(i + 1) % k], two[(i + 1) % k], two[i]] for i in range(k)]
    other = es.TriangleMesh(mesh.vertices, np.concatenate([mesh.faces[~gone], tube]))
    labels = np.append(np.where(cap, 0, -1)[~gone], np.zeros(2 * k, dtype=int))
    return mesh, other, np.where(cap, 0, -1), labels


def _rim(mesh, vertex):
    """The vertices around one, in order."""
    following = {}
    for face in mesh.faces[(mesh.faces == vertex).any(axis=1)]:
        place = int(np.flatnonzero(face == vertex)[0])
        following[face[(place + 1) % 3]] = face[(place + 2) % 3]
    rim = [next(iter(following))]
    while len(rim) < len(following):
        rim.append(following[rim[-1]])
    return np.array(rim)
