"""What befalls a query on its way: noise, another resolution, a depth camera, faces turned over."""

import numpy as np

import eigenshape as es

CLEAN, FLIPPED, HALF, DOUBLE = "clean", "flipped", "half resolution", "double resolution"
SCANS = {"scanner": False, "scanner, all pieces": True}
NOISES = {
    "noise .1": 0.1,
    "noise .25": 0.25,
    "noise .5": 0.5,
}  # of the mean edge, in each coordinate
CHANGES = (CLEAN, *NOISES, HALF, DOUBLE, *SCANS, FLIPPED)


def changed_whole(mesh: es.TriangleMesh, change: str) -> es.TriangleMesh:
    """Return a whole shape, before it is cut, with half the faces or with edges half as long, if that is the change."""
    if change == HALF:
        return halved(mesh)
    return es.geometry.subdivide(mesh) if change == DOUBLE else mesh


def changed_part(mesh: es.TriangleMesh, change: str, rng: np.random.Generator) -> es.TriangleMesh:
    """Return what was cut with noise, or turned over, where that is the change."""
    if change in NOISES:
        return noisy(mesh, NOISES[change], rng)
    return turned_over(mesh) if change == FLIPPED else mesh


def noisy(mesh: es.TriangleMesh, share: float, rng: np.random.Generator) -> es.TriangleMesh:
    """Move each vertex by Gaussian noise whose deviation in each coordinate is a share of the mean edge."""
    deviation = share * es.geometry.edge_lengths(mesh).mean()
    return es.TriangleMesh(
        mesh.vertices + deviation * rng.standard_normal(mesh.vertices.shape), mesh.faces
    )


def turned_over(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Return the faces seen from the other side."""
    return es.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def halved(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Collapse the shortest edges until half the faces are left."""
    import igl  # noqa: PLC0415 - of the extra "test"; all other changes do without

    found = igl.decimate(np.array(mesh.vertices), np.array(mesh.faces), mesh.n_faces // 2)
    points, faces = (
        found[:2] if isinstance(found[0], np.ndarray) else found[1:3]
    )  # older ones say first if it is done
    return es.repair(es.TriangleMesh(points, faces), ["drop_unreferenced"]).mesh
