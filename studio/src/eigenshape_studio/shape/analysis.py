"""A mesh, and what is computed of it in the background."""

import copy
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

import eigenshape as es
from eigenshape.plot.camera import Up, View, upward_direction
from eigenshape_studio.shape.jobs import NO_JOB, Job, Progress
from eigenshape_studio.shape.sides import recall_side

# Modes that are solved for when a shape is opened, beside one for each further component: as many
# as `es.rig_shape` takes, so that both give the same rig.
N_MODES = 300
# Above this number of vertices nothing is computed before a person asks for it.
LARGE = 200_000
LIGHT = 25_000  # vertices of the lighter copy that is offered then
# Bytes for each vertex, measured with a million: 300 eigenpairs with the factor of the solve, and the
# examination with a trial of each repair.
SPECTRUM_BYTES, HEALTH_BYTES = 4000, 1000
CELLS = 64  # along the longest side of the box, to which a large shape is simplified to be framed
# Radians by which the page looks past the upward axis in a view along it: its camera turns about
# that axis, so it needs a side on which to stand. 0.06 degrees are not seen.
PAST_UP = 1e-3


class Analysis:
    """A mesh, and the jobs that compute its health, spectrum, rig and parts.

    The health, the spectrum and the rig start at once unless the mesh is large, the parts by
    `find_parts`.

    Parameters
    ----------
    mesh : TriangleMesh
    name : str
        Shown on the page.
    n_modes : int
        Number of eigenpairs, beside one for each further component.
    shared : bool
        Whether several tabs show this mesh, so that none may cancel its jobs.
    """

    def __init__(
        self, mesh: es.TriangleMesh, name: str, *, n_modes: int = N_MODES, shared: bool = False
    ) -> None:
        self.mesh = mesh
        self.name = name
        self.side: tuple[View, Up] = ("auto", "auto")  # from which the page looks
        self._n_modes = n_modes
        # The first that a page asks for; it has begun when the browser opens.
        self._upright: Job[dict[str, Any]] = Job(lambda _: frame_shape(mesh), shared=True)
        begin = mesh.n_vertices <= LARGE
        self.health: Job[dict[str, Any]] = Job(self._assess_health, shared=shared, begin=begin)
        self.spectrum: Job[es.Spectrum] = Job(self._solve_default, shared=shared, begin=begin)
        solved = self.spectrum
        self.rig: Job[es.deformation.EigenRig] = Job(
            lambda _: self._prepare_rig(solved), shared=shared, begin=begin
        )
        self.parts: Job[es.features.PartDecomposition] | None = None
        self.brackets: es.spectral.Brackets | None = None

    def solve(self, k: int) -> None:
        """Compute another number of eigenpairs; the rig keeps its own."""
        mesh = self.mesh
        self.health.start()  # Weyl's law takes the area
        if k == self._n_modes and not self.spectrum.begun:
            self.spectrum.start()  # which the rig takes, too
            return
        self.spectrum.cancel()
        self.spectrum = Job(lambda progress: _solve(mesh, k, progress))

    def prepare(self) -> None:
        """Start all that a large mesh was not examined for when it was opened."""
        for job in (self.health, self.spectrum, self.rig):
            job.start()

    def large_facts(self) -> str:
        """Return what the page says of a large mesh of which something was not computed yet."""
        n_vertices = self.mesh.n_vertices
        if self.health.begun and self.rig.begun:
            return ""
        memory, less = (
            f"{n_vertices * each / 1e9:.1f} GB" for each in (SPECTRUM_BYTES, HEALTH_BYTES)
        )
        return (
            f"This shape has {n_vertices:,} vertices, so nothing is computed before you ask for it. "
            f"Its spectrum, and bending it, takes about {memory} of memory and some minutes; looking "
            f"for faults takes about {less}. A lighter copy of {LIGHT:,} vertices needs neither."
        )

    def find_parts(self) -> None:
        """Start to compute the parts, unless they are there or on the way."""
        mesh = self.mesh
        if self.parts is None or self.parts.status in ("none", "failed"):
            self.parts = Job(lambda progress: es.find_parts(mesh, progress=progress))

    def cancel(self) -> None:
        """Stop all jobs that are not shared."""
        for job in (self.health, self.spectrum, self.rig, self.parts):
            if job is not None:
                job.cancel()

    def resume(self) -> "Analysis":
        """Return this analysis, or one that begins anew if its jobs were stopped."""
        jobs = (self.health, self.spectrum, self.rig)
        if all(job.shared or job.status == "ready" or not job.begun for job in jobs):
            return self
        again = Analysis(self.mesh, self.name, n_modes=self._n_modes)
        again.look_from(*self.side)
        return again

    def fork(self) -> "Analysis":
        """Return an analysis of the same mesh that shares the jobs which have been started."""
        return copy.copy(self)

    def view(self) -> dict[str, Any]:
        """Return how to look at the mesh: center and diagonal of its box, up and front."""
        self._upright.wait()
        if self._upright.result is None:
            raise self._upright.error or es.EigenshapeError("The view was cancelled.")
        return self._upright.result

    def look_from(self, view: View, up: Up) -> None:
        """Show the mesh from another side, from the next time on that a page asks for its view.

        Raises
        ------
        InvalidParameterError
            If `view` or `up` is neither a name nor a direction, as in `es.plot.aim_camera`.
        """
        found = frame_shape(self.mesh, view, up)
        self.side = view, up
        self._upright = Job(lambda _: found, shared=True)

    @cached_property
    def areas(self) -> np.ndarray:
        """The area around each vertex."""
        return es.geometry.dual_volumes(self.mesh)

    def health_facts(self) -> dict[str, Any]:
        """Return what is known of the faults of the mesh so far."""
        nothing = ("components", "boundary_loops", "closed", "manifold", "area", "volume")
        unknown: dict[str, Any] = {**dict.fromkeys(nothing), "findings": []}
        found = self.health.result or unknown
        status = self.health.status
        return {"status": status, **found, **describe_health(self.mesh, found, status)}

    def spectrum_facts(self) -> dict[str, Any]:
        """Return how far the spectrum is, and what is proved of it."""
        found = self.spectrum.result
        proof = None if found is None else found.certificate
        return {
            **self.spectrum.facts(),
            "k": 0 if found is None else len(found.eigenvalues),
            "certificate": "" if proof is None else proof.explain(),
            "complete": proof is not None and proof.complete,
        }

    def parts_facts(self) -> dict[str, Any]:
        """Return how far the parts are, and how persistent each is."""
        found = None if self.parts is None else self.parts.result
        n_fine = 0 if found is None else len(found.fine.features.vertices)
        return {
            **(NO_JOB if self.parts is None else self.parts.facts()),
            "n_regions": 0 if found is None else len(found.parts.features.vertices),
            "levels": [] if found is None else found.tree.persistence[:n_fine].tolist(),
        }

    def _assess_health(self, _progress: Progress) -> dict[str, Any]:
        self._upright.wait()  # nothing may delay the first picture
        return assess_health(self.mesh)

    def _solve_default(self, progress: Progress) -> es.Spectrum:
        self._upright.wait()
        n_components, _ = es.geometry.vertex_components(self.mesh)
        wanted = min(self._n_modes + n_components - 1, self.mesh.n_vertices)
        return _solve(self.mesh, wanted, progress)

    def _prepare_rig(self, solved: Job[es.Spectrum]) -> es.deformation.EigenRig:
        self._upright.wait()
        solved.wait()
        if solved.result is None:
            raise es.EigenshapeError(solved.message or "The spectrum was cancelled.")
        return es.rig_shape(self.mesh, solved.result)


def _solve(mesh: es.TriangleMesh, k: int, progress: Progress) -> es.Spectrum:
    return es.solve_spectrum(es.cotangent_laplacian(mesh), k, progress=progress)


def frame_shape(mesh: es.TriangleMesh, view: View = "auto", up: Up = "auto") -> dict[str, Any]:
    """Return center and diagonal of the box of a mesh, and how it stands upright.

    Where no side is requested, it stands as a person has corrected it, if one has.
    """
    is_guessed = isinstance(view, str) and isinstance(up, str) and view == up == "auto"
    corrected = recall_side(mesh) if is_guessed else None
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    if mesh.n_vertices > LARGE:
        mesh = cluster_vertices(mesh, CELLS)
    return {
        "center": ((low + high) / 2).tolist(),
        "extent": float(np.linalg.norm(high - low)),
        **(corrected or upright_view(mesh, view, up)),
    }


def cluster_vertices(mesh: es.TriangleMesh, n_cells: int) -> es.TriangleMesh:
    """Unite the vertices in each cell of a grid (Rossignac and Borrel 1993).

    With a million vertices this takes a tenth of the time of `thin_out`. The result need not be a
    manifold, which a guess of the upright pose does not need.
    """
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    cells = ((mesh.vertices - low) * (n_cells / (high - low).max())).astype(np.int64)
    cells = cells @ np.array([1, n_cells + 1, (n_cells + 1) ** 2])
    _, cluster, sizes = np.unique(cells, return_inverse=True, return_counts=True)
    sums = [np.bincount(cluster, mesh.vertices[:, axis]) for axis in range(3)]
    faces = cluster[mesh.faces]
    apart = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return es.TriangleMesh(np.column_stack(sums) / sizes[:, None], faces[apart])


def upright_view(
    mesh: es.TriangleMesh, view: View = "auto", up: Up = "auto"
) -> dict[str, list[float]]:
    """Return the upward axis of a shape, and the direction to the viewer, as of `aim_camera`."""
    upward = upward_direction(mesh, up)
    _, down, towards = es.plot.aim_camera(mesh, view=view, up=up).rotation
    if np.linalg.norm(np.cross(upward, towards)) < PAST_UP:
        towards = towards + PAST_UP * np.sign(towards @ upward) * down
        towards /= np.linalg.norm(towards)
    return {"up": upward.tolist(), "towards": towards.tolist()}


def assess_health(mesh: es.TriangleMesh) -> dict[str, Any]:
    """Return counts and faults of a mesh, and what each suggested repair would do."""
    closed = es.geometry.is_closed(mesh)
    names = es.suggest_repairs(mesh)
    report = es.repair(mesh, names).report
    return {
        "components": es.geometry.vertex_components(mesh)[0],
        "boundary_loops": len(es.geometry.boundary_loops(mesh)),
        "closed": closed,
        "manifold": es.geometry.is_manifold(mesh),
        "area": es.geometry.surface_area(mesh),
        "volume": _volume(mesh) if closed else None,
        "findings": [_finding(name, why) for name, why in zip(names, report, strict=True)],
    }


def describe_health(
    mesh: es.TriangleMesh, health: dict[str, Any], status: str
) -> dict[str, list[tuple[str, str]]]:
    """Return sizes by their names, and a line of text for each fact of health: good or fair."""
    facts = [("Vertices", f"{mesh.n_vertices:,}"), ("Faces", f"{mesh.n_faces:,}")]
    if status != "ready":
        texts = {"failed": "It cannot be examined.", "none": "It has not been examined."}
        return {"facts": facts, "lines": [("fair", texts.get(status, "It is being examined …"))]}
    volume = health["volume"]
    enclosed = "none: it is not closed" if volume is None else f"{volume:.4g} length³"
    facts += [("Area", f"{health['area']:.4g} length²"), ("Volume", enclosed)]
    n_pieces, n_rims = health["components"], health["boundary_loops"]
    rims = "1 boundary" if n_rims == 1 else f"{n_rims:,} boundaries"
    sheets = "Some edges or vertices join more than one sheet."
    lines = [
        _line(n_pieces == 1, "It is one piece.", f"It consists of {n_pieces:,} separate pieces."),
        _line(
            health["closed"],
            "It is closed: it has an inside and an outside.",
            f"It is open, with {rims}.",
        ),
        _line(health["manifold"], "It is a clean surface (manifold).", sheets),
    ]
    if not health["findings"]:
        lines.append(("good", "No repair is needed."))
    return {"facts": facts, "lines": lines}


def _line(good: bool, if_good: str, otherwise: str) -> tuple[str, str]:
    return ("good", if_good) if good else ("fair", otherwise)


def _finding(name: str, why: str) -> dict[str, str]:
    """Return a repair that would help: its name, and what it would do, as the page shows it."""
    text = f"A trial of {why.replace(name, name.replace('_', ' '))}."
    return {"name": name, "why": why, "text": text}


def _volume(mesh: es.TriangleMesh) -> float | None:
    try:
        return es.geometry.enclosed_volume(mesh)
    except es.InvalidShapeError:  # some faces are oriented against others
        return None


def vertex_labels(mesh: es.TriangleMesh, labels: np.ndarray) -> np.ndarray:
    """Return, for each vertex, the region that has most of the area around it."""
    areas = np.repeat(es.geometry.face_areas(mesh), 3)
    shape = (mesh.n_vertices, int(labels.max()) + 1)
    around = sp.coo_array((areas, (mesh.faces.ravel(), np.repeat(labels, 3))), shape=shape)
    return np.asarray(around.tocsr().argmax(axis=1)).ravel().astype(np.int32)


def cut_rows(found: es.features.PartDecomposition) -> np.ndarray:
    """Return the part of each fine part for every number of parts, one row each, fewest first.

    Parts are sorted by falling persistence, so the last one that is left is always the next to
    merge with its parent. Their boundaries are smooth in every cut.
    """
    parent = found.tree.parent[: len(found.fine.features.vertices)]
    part = np.arange(len(parent), dtype=np.int32)
    rows = [part.copy()]
    for last in range(len(part) - 1, np.count_nonzero(parent < 0) - 1, -1):
        part[part == last] = part[parent[last]]
        rows.append(part.copy())
    return np.stack(rows[::-1])


def diagram_rows(mesh: es.TriangleMesh, heat: np.ndarray) -> np.ndarray:
    """Return the persistence diagram of heat: birth, death, persistence and vertex of each maximum.

    A maximum that never merges dies, for the picture, at the least heat; its persistence is inf.
    """
    tree = es.merge_tree(mesh, heat)
    deaths = np.where(np.isinf(tree.persistence), heat.min(), tree.values - tree.persistence)
    return np.column_stack([tree.values, deaths, tree.persistence, tree.maxima])
