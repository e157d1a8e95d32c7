"""What every public function does with small shared values: the table that the law of threads runs through."""

import io
import secrets
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.sparse as sp
from describers import keep
from qdrant_client import QdrantClient
from registered_operators import builders
from search_cases import RECIPE, make_source, mixtures

import eigenshape as es
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS
from eigenshape.retrieval.search.coarse import coarse_rows


def rng() -> np.random.Generator:
    """Return random numbers of this call alone: a generator is no value, and not to be shared."""
    return np.random.default_rng(7)


class Shared:
    """Values that all threads use at once; each is made once, before the threads begin."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.ball, self.grid, self.torus = (
            es.icosphere(2),
            es.shapes.grid(8, 8),
            es.shapes.torus(24, 12),
        )
        self.solid, self.cloud = es.shapes.box(3, 3, 3), es.PointCloud(es.icosphere(3).vertices, 2)
        self.animal, self.pose = (
            es.make_creature("quadruped", pose, n_vertices=700) for pose in (0, 1)
        )
        self.fish, self.fish_pose = (
            es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1)
        )
        self.fish_target = es.matching.prepare_target(self.fish_pose)
        self.fish_scan = es.partial_scan(es.make_creature("fish", n_vertices=1200), [0, 0, 1]).mesh
        self.motion = es.matching.register_scans(self.fish_scan, self.fish_scan)
        self.fish_match = es.match_shapes(self.fish, self.fish_target)
        self.bones = {"one": self.fish, "two": self.fish}
        self.collection = es.collections.build_collection(self.bones, self.folder / "bones")
        self.similarity = es.collections.Similarity(2.0, np.eye(3), np.ones(3))
        self.tip = es.morphometrics.Landmarks(["tip"], self.fish.vertices[[9]])
        self.camera = es.plot.Camera(np.eye(3), 60)
        self.labels = (self.animal.vertices[self.animal.faces[:, 0], 1] > 0).astype(np.int64)
        self.laplacian, self.other = (
            es.cotangent_laplacian(self.animal),
            es.cotangent_laplacian(self.pose),
        )
        self.spectrum, self.spectrum2 = (
            es.solve_spectrum(self.laplacian, 30),
            es.solve_spectrum(self.other, 30),
        )
        self.times = es.spectral.default_times(self.spectrum, 5)
        self.heat = es.heat_kernel_signature(self.spectrum, self.times)
        self.tree = es.merge_tree(self.animal, self.heat[:, -1])
        self.parts = es.segment(self.tree, n_regions=5)
        self.diagram = es.features.persistence_diagram(self.animal, self.heat[:, -1])
        self._make_bends()
        self._make_maps()
        self._make_descriptors()
        self._make_perturbation()
        # Dot products of more than 10,000 numbers are where BLAS begins to cut sums among its threads.
        self.many = es.shapes.fibonacci_sphere(10_500)
        self.many_laplacian = es.cotangent_laplacian(self.many)
        self.many_spectrum = es.solve_spectrum(self.many_laplacian, 9)
        self.many_map = es.functional_map(
            self.many_spectrum, self.many_spectrum, [[0, 0], [99, 99]], n_modes=4
        )
        self.labeled = es.retrieval.LabeledShape(self.animal, self.labels)
        self.transfer = es.transfer_labels(self.labeled, self.pose)
        self._make_solvers()
        self._make_graph()
        self._make_files()

    def _make_bends(self) -> None:
        heights = self.animal.vertices[:, 1]
        self.region = heights > np.quantile(heights, 0.8)
        self.fixed = heights < np.quantile(heights, 0.3)
        self.rig = es.rig_shape(self.animal, self.spectrum)
        self.handle = es.Rotation(self.animal.vertices[self.region].mean(axis=0), [0, 0, 1], 0.6)
        self.move = es.Translation([0.1, 0.2, 0.0])
        self.binding = es.deformation.bind(self.rig, [self.region], fixed=self.fixed, n_modes=12)
        self.response = es.deformation.skeleton_response(self.binding)
        self.detailed = es.deformation.detailed_skeleton(self.binding)
        self.edit = es.deformation.Edit(
            (es.deformation.Move(self.region, self.handle),), self.fixed, 12
        )

    def _make_maps(self) -> None:
        pairs = np.repeat(np.arange(0, 700, 70), 2).reshape(-1, 2)
        self.map = es.functional_map(self.spectrum, self.spectrum2, pairs, n_modes=8)
        self.latent = es.spectral.latent_basis({(0, 1): self.map})

    def _make_descriptors(self) -> None:
        self.codebook = es.retrieval.default_codebook()
        self.patches = (
            es.retrieval.extract_patches(self.ball, n_samples=40, n_views=0)[0],
            es.retrieval.extract_patches(self.torus, n_samples=40, n_views=0)[0],
        )
        self.animal_patches = es.retrieval.extract_patches(self.animal, n_views=0)
        self.recipe = es.retrieval.PatchRecipe(self.codebook)
        self.by_patches = tuple(
            es.retrieval.patch_descriptor([patches], self.recipe) for patches in self.patches
        )
        self.by_heat = tuple(
            es.retrieval.heat_descriptor(spectrum, es.segment(self.tree, n_regions=6).features)
            for spectrum in (self.spectrum, self.spectrum2)
        )
        self.meshes = self.folder / "meshes"
        self.meshes.mkdir()
        (self.meshes / "cat.ply").touch()
        self.index = es.ShapeIndex.create(self.folder / "index")
        for number, (by_heat, by_patches) in enumerate(
            zip(self.by_heat, self.by_patches, strict=True)
        ):
            keep(self.index, f"shape {number}", [by_heat])
            keep(self.index, f"by patches {number}", [by_patches])

        self.reader = self.index.reader()
        self.coarse = coarse_rows(make_source(self.folder, 400), RECIPE)
        self.faiss = es.retrieval.FaissEngine(self.coarse)

    def _make_perturbation(self) -> None:
        moved = es.TriangleMesh(self.ball.vertices * [1.0, 1.02, 1.0], self.ball.faces)
        self.change = es.stability.measure_perturbation(self.ball, moved)
        self.nodes = es.stability.anchor_nodes(self.ball, 0.5)
        self.on_one, self.on_two = (
            es.geometry.sample_surface(mesh, 60, rng=rng()) for mesh in (self.ball, moved)
        )
        self.report = es.compare_shapes(
            self.ball,
            moved,
            es.stability.StabilityPlan(k=5, n_samples=200, times=(0.05,)),
            partners=None,
        )

    def _make_solvers(self) -> None:
        self.height = self.many.vertices[:, 2]
        self.field = self.many.vertices[self.many.faces].mean(axis=1)
        self.poisson = es.calculus.factor_equations(self.many_laplacian.stiffness)
        self.bound = es.calculus.factor_equations(
            self.laplacian.stiffness,
            fixed=[0, 9],
            constraints=self.laplacian.mass.sum(axis=0)[None],
        )
        self.by_heat_flow = es.calculus.prepare_heat_geodesics(self.many)
        self.by_vector_heat = es.calculus.prepare_vector_heat(self.animal)
        self.form = np.sin(np.arange(len(es.calculus.one_form_edges(self.torus))))
        self.circle = es.calculus.level_set(self.many, self.height, 0.1)
        self.cut = es.calculus.level_set(self.solid, self.solid.points[:, 0], 0.4)

    def _make_graph(self) -> None:
        self.normalized = es.operators.graph_laplacian(self.animal, "normalized")
        self.graph_spectrum = es.solve_spectrum(self.normalized, 8)
        self.many_coefficients = es.spectral.project(self.many.vertices, self.many_spectrum)
        self.packed = es.spectral.compress_mesh(self.torus)
        self.marked = es.spectral.embed_watermark(self.animal, "a key", k=30)
        self.bundle = es.spectral.operator_bundle(self.ball, 6)
        self.recovered = es.spectral.recover_geometry(es.shapes.sphere_eigenvalues(300))

    def _make_files(self) -> None:
        es.write_mesh(self.ball, self.folder / "ball.ply")
        es.io.write_points(self.cloud, self.folder / "cloud.ply")
        es.io.write_edits([self.edit], self.animal, self.folder / "edits.json")
        self.spectrum.save(self.folder / "spectrum.npz")
        (self.folder / "square.mesh").write_text(
            "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n"
            "Triangles\n2\n1 2 3 0\n1 3 4 0\nEnd\n"
        )
        self.labeled_folder = self.folder / "labeled"
        self.labeled_folder.mkdir()
        es.write_mesh(self.animal, self.labeled_folder / "animal.off")
        (self.labeled_folder / "animal.seg").write_text("\n".join(map(str, self.labels)))
        (self.labeled_folder / "names.txt").write_text("torso\nleg\n")
        # Configurations of enough points for BLAS to cut its sums
        self.skulls = rng().standard_normal((5, 1, 3)) + np.repeat(
            self.animal.vertices[None], 5, axis=0
        ) * np.exp(0.1 * rng().standard_normal((5, self.animal.n_vertices, 3)))
        self.skull = es.morphometrics.Landmarks(["nose", "left", "right"], np.eye(3))
        es.morphometrics.write_landmarks(self.skull, self.folder / "skull.mrk.json")
        self.bytes = es.retrieval.write_codebook(self.codebook)
        es.io.write_fields(self.animal, self.folder / "fields.vtu", {"heat": self.heat})
        self.halves = es.features.Parcellation((self.animal.vertices[:, 1] > 0).astype(int))
        es.io.write_parcellation(self.animal, self.folder / "halves.annot", self.halves)
        es.io.write_fields(self.animal, self.folder / "heat.mgh", {"heat": self.heat[:, 0]})
        self.label_image = np.arange(1000).reshape(10, 10, 10) % 7
        self.attributes = es.read_mesh(self.folder / "ball.ply", attributes=True)[1]
        es.io.write_fields(es.icosphere(1), self.folder / "worn.vtp", {"x": np.arange(42.0)})
        self.worn = es.read_mesh(self.folder / "worn.vtp", attributes=True)[1]


def drawn(figure: Any) -> bytes:
    """Return a figure as PNG."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=40, metadata={"Software": None})
    return picture.getvalue()


def written(folder: Path, suffix: str, write: Callable[[Path], object]) -> bytes:
    """Return what is written to a file of this call alone."""
    path = folder / f"{secrets.token_hex(8)}{suffix}"
    write(path)
    return path.read_bytes()


def saved(v: Shared, suffix: str) -> bytes:
    """Return a figure of this call alone as the bytes of a file."""
    figure = es.plot.figure_diagram(v.diagram)
    return written(v.folder, suffix, lambda path: es.save_figure(figure, path))


def session_of(v: Shared) -> tuple[object, ...]:
    """Drive a session of this thread alone over a shared rig: a session is the one mutable object."""
    session = es.DeformationSession(v.rig)
    dragged = session.drag(v.region, v.handle, fixed=v.fixed, n_modes=12)
    session.drag_all([es.deformation.Move(v.region, v.move)], fixed=v.fixed, n_modes=12)
    bent = session.commit()
    back, forth = session.undo(), session.redo()
    session.cancel()
    session.apply(v.edit)
    return dragged, bent, back, forth, session.mesh, session.edits


def index_of(v: Shared) -> tuple[object, ...]:
    """Write an index of this call alone: one writer at a time is what an index allows."""
    index = es.ShapeIndex.create(v.folder / secrets.token_hex(8))
    keep(index, "one", [v.by_heat[0]])
    index.keep_recipe(v.recipe)
    keep(index, "two", [v.by_heat[1]])
    index.add("three", v.ball, n_views=0)
    index.remove("one")
    fish = es.retrieval.DescribedShape("four", [v.by_heat[1]], tags=["t"])
    index.add_many([fish])
    whole = es.ShapeIndex.create(None)
    whole.merge([index])
    index.compact()
    index.export(index.folder.with_suffix(".out"))
    index.prune(v.folder)
    found = index.verify().damages, whole.records(), whole.thumbnail("three")
    return index.records(), index.recipes(), found


def answers(v: Shared) -> tuple[object, ...]:
    """Query the index that all threads read."""
    index = es.ShapeIndex.open(v.index.folder)
    by_heat, by_patches = v.by_heat[0], v.by_patches[0]
    found = [index.query(asked, n_matches=2) for asked in (by_heat, by_patches)]
    return (
        found,
        index.records(),
        index.recipes(),
        len(index),
        index.descriptors("shape 0", by_heat.recipe),
    )


def classes(v: Shared) -> dict[str, float]:
    """Return the chances of the classes of a query by patches."""
    return v.reader.query(v.by_patches[0], n_matches=5).classify()


def decimated(v: Shared) -> tuple[object, ...]:
    """Decimate a mesh, and carry a function and labels to the smaller one."""
    done = es.geometry.decimate(v.animal, ratio=0.5)
    return done, done.carry_values(v.heat), done.carry_labels(v.labels)


def brain(v: Shared) -> es.modes.BrainPrint:
    """Describe a brain of two structures."""
    return es.modes.brain_print({"lh": v.animal, "rh": v.ball}, 9)


def asked(v: Shared) -> tuple[object, ...]:
    """Ask the reader that all threads share."""
    snapshot = v.reader.snapshot(v.by_heat[0].recipe)
    found = v.reader.query(v.by_heat[0], n_matches=2, where={"label": None})
    return v.reader.refresh(), found, len(v.reader), snapshot.n_shapes, v.reader.default_recipe()


def engines(v: Shared) -> tuple[object, ...]:
    """Ask engines for candidates: one that all threads share, and a database of this call alone."""
    codes = mixtures(3, 1)[0, 0]
    queries = v.coarse.axes.project_query(codes)
    database = es.retrieval.QdrantEngine(QdrantClient(":memory:"), "shapes")
    database.fill(v.coarse)
    nearest = v.faiss.nearest(queries, 5), database.nearest(queries, 5)
    return v.coarse.scores(codes), nearest


def cached(v: Shared) -> es.Spectrum:
    """Solve by way of a cache that all threads share."""
    return es.solve_spectrum(v.laplacian, 6, cache=v.folder / "cache")


CALLS: dict[str, Callable[[Shared], object]] = {
    "DecimatedMesh": decimated,
    "DeformationSession": session_of,
    "DepthCamera": lambda v: es.scans.simulate_scan(
        v.ball, rng(), camera=es.scans.DepthCamera(resolution=40)
    ),
    "LevelSet.interpolate": lambda v: v.circle.interpolate(v.many.vertices),
    "LevelSet.polylines": lambda v: v.circle.polylines(),
    "LevelSet.surface": lambda v: v.cut.surface(),
    "LinearSolver": lambda v: [
        v.poisson.floating_sums(v.many.vertices),
        v.poisson.solve(v.many_laplacian.mass @ v.height),
        v.bound.solve(v.animal.vertices, values=[[1.0], [2.0]], targets=[[3.0]]),
    ],
    "PatchDescriptor.is_mirror_image": lambda v: v.by_patches[0].is_mirror_image(v.by_patches[1]),
    "Rate.at": lambda v: es.stability.theorem_rate("lipschitz", 2).at([0.1, 0.2], 0.01),
    "RecoveredGeometry.whole_characteristic": lambda v: [
        v.recovered.whole_characteristic(even=even) for even in (False, True)
    ],
    "Rotation.carry": lambda v: v.handle.carry(
        v.ball.vertices, np.linspace(0, 1, v.ball.n_vertices)
    ),
    "Scaling.carry": lambda v: es.deformation.Scaling([0.1, 0, 0], [2, 1, 0.5]).carry(
        v.ball.vertices, np.linspace(0, 1, v.ball.n_vertices)
    ),
    "Scaling.stretch": lambda v: es.deformation.Scaling([0.1, 0, 0], [2, 1, 0.5]).stretch(
        v.ball.vertices, np.linspace(0, 1, v.ball.n_vertices)
    ),
    "Translation.carry": lambda v: v.move.carry(
        v.ball.vertices, np.linspace(0, 1, v.ball.n_vertices)
    ),
    "ShapeIndex": answers,
    "ShapeIndex.add": index_of,
    "CoarseRows": engines,
    "FaissEngine": engines,
    "IndexReader": asked,
    "Matches.classify": classes,
    "carry_attributes": lambda v: es.io.carry_attributes(v.attributes, es.icosphere(1)).mesh,
    "decimate": decimated,
    "tetrahedralize": lambda v: es.geometry.tetrahedralize(v.ball),
    "find_duplicates": lambda v: es.retrieval.find_duplicates(es.ShapeIndex.open(v.index.folder)),
    "read_fields": lambda v: es.io.read_fields(v.folder / "fields.vtu"),
    "mask_surface": lambda v: es.geometry.mask_surface(v.animal, v.animal.vertices[:, 1] > 0),
    "brain_print": lambda v: es.modes.brain_print({"lh": v.animal, "rh": v.ball}, 9),
    "BrainPrint.asymmetry": lambda v: brain(v).asymmetry(),
    "BrainPrint.distances": lambda v: brain(v).distances(brain(v)),
    "CondensedFeatures.table": lambda v: es.features.condense(v.animal, v.animal.vertices).table(
        ["x", "y", "z"]
    ),
    "condense": lambda v: es.features.condense(v.animal, v.heat),
    "parcellate": lambda v: es.features.parcellate(v.animal, v.heat, v.halves),
    "read_parcellation": lambda v: es.io.read_parcellation(v.folder / "halves.annot", v.animal),
    "read_volume": lambda v: es.io.read_volume(v.folder / "heat.mgh"),
    "structure_surfaces": lambda v: es.modes.structure_surfaces(v.label_image, structures={"a": 3}),
    "voxel_surface": lambda v: es.calculus.voxel_surface(v.label_image == 2),
    "unmask": lambda v: es.geometry.unmask(v.heat, np.arange(v.animal.n_vertices), 900),
    "write_parcellation": lambda v: written(
        v.folder, ".annot", lambda path: es.io.write_parcellation(v.animal, path, v.halves)
    ),
    "split_solids": lambda v: es.geometry.split_solids(
        v.solid.points, [[0, 1, 5, 4, 16, 17, 21, 20]]
    ),
    "write_fields": lambda v: written(
        v.folder, ".vtu", lambda path: es.io.write_fields(v.animal, path, {"heat": v.heat})
    ),
    "QdrantEngine": engines,
    "SpectralClusterer": lambda v: es.spectral.SpectralClusterer(3).fit_predict(v.torus.vertices),
    "SpectralEmbedder": lambda v: es.spectral.SpectralEmbedder(3).fit_transform(v.torus.vertices),
    "Spectrum.save": lambda v: written(v.folder, ".npz", v.spectrum.save),
    "Spectrum.load": lambda v: es.Spectrum.load(v.folder / "spectrum.npz"),
    "aim_camera": lambda v: es.plot.aim_camera(v.many),
    "anchor_nodes": lambda v: es.stability.anchor_nodes(v.ball, 0.5),
    "anchor_region": lambda v: es.stability.anchor_region(v.on_one.points, v.nodes.points, 0.5),
    "angle_distortion": lambda v: es.calculus.angle_distortion(
        v.many, v.many.vertices * [1.0, 2.0, 3.0]
    ),
    "anisotropic_laplacian": lambda v: es.operators.anisotropic_laplacian(
        v.ball, es.operators.curvature_tensors(v.ball, 2.0)
    ),
    "apply_heat": lambda v: [
        es.spectral.apply_heat(v.laplacian, v.animal.vertices, 0.01),
        es.spectral.apply_heat(v.many_spectrum, v.height, [0.1, 0.2]),
    ],
    "approximate_heat_signature": lambda v: es.spectral.approximate_heat_signature(
        v.many_laplacian, 8, [0.5, 1.0]
    ),
    "as_mesh": lambda v: es.as_mesh((v.ball.vertices, v.ball.faces)),
    "as_shape": lambda v: es.geometry.as_shape((v.ball.vertices, v.ball.faces)),
    "average_geodesic_distance": lambda v: es.geometry.average_geodesic_distance(
        v.animal, n_bases=40
    ),
    "average_onto_points": lambda v: es.calculus.average_onto_points(v.many, v.field),
    "ball": lambda v: es.shapes.ball(3),
    "ball_eigenvalues": lambda v: es.shapes.ball_eigenvalues(9),
    "bend": lambda v: [
        es.deformation.bend(v.binding, [v.handle], mode=mode)
        for mode in ("graded", "uncrossed", "thesis")
    ],
    "betti_numbers": lambda v: [es.geometry.betti_numbers(mesh) for mesh in (v.torus, v.solid)],
    "bind": lambda v: es.deformation.bind(v.rig, [v.region], fixed=v.fixed).shares,
    "bottleneck_matching": lambda v: es.stability.bottleneck_matching(
        v.on_one.points, v.on_two.points
    ),
    "boundary_edges": lambda v: es.geometry.boundary_edges(v.grid),
    "boundary_load": lambda v: es.calculus.boundary_load(v.grid, 1.0),
    "boundary_loops": lambda v: es.geometry.boundary_loops(v.grid),
    "boundary_vertices": lambda v: es.geometry.boundary_vertices(v.grid),
    "boundary_surface": lambda v: es.geometry.boundary_surface(v.solid),
    "box": lambda v: es.shapes.box(2, 2, 2),
    "box_eigenvalues": lambda v: es.shapes.box_eigenvalues(9),
    "bracket_eigenvalues": lambda v: es.bracket_eigenvalues(v.ball, 5),
    "build_laplacian": lambda v: [
        es.build_laplacian(v.torus, name)
        for name, entry in es.operators.OPERATORS.items()
        if es.TriangleMesh in entry.shapes
    ],
    "certify": lambda v: es.spectral.certify(
        v.laplacian, v.spectrum.eigenvalues, v.spectrum.eigenvectors
    ),
    "check_laplacian": lambda v: es.spectral.check_laplacian(v.laplacian, v.animal),
    "check_operator": lambda v: es.check_operator(es.cotangent_laplacian, v.ball),
    "cheeger_estimate": lambda v: es.stability.cheeger_estimate(v.animal, v.spectrum),
    "circle": lambda v: es.shapes.circle(9),
    "closest_points": lambda v: es.geometry.closest_points(v.animal, v.ball.vertices),
    "compare_shapes": lambda v: es.compare_shapes(
        v.ball, v.torus, es.stability.StabilityPlan(k=3, n_samples=150, times=(0.05,))
    ),
    "compare_spectra": lambda v: es.spectral.compare_spectra(v.spectrum, v.spectrum2),
    "compress_mesh": lambda v: es.spectral.compress_mesh(v.torus),
    "connection_laplacian": lambda v: es.operators.connection_laplacian(v.ball),
    "correspondence_graph": lambda v: es.stability.correspondence_graph(
        v.change, v.on_one, v.on_two, nodes=v.nodes.points, delta=0.5, rho=3.0
    ),
    "cotangent_laplacian": lambda v: es.cotangent_laplacian(v.many),
    "count_clusters": lambda v: es.spectral.count_clusters(v.graph_spectrum),
    "courant_bounds": lambda v: es.spectral.courant_bounds(v.spectrum),
    "crouzeix_raviart_laplacian": lambda v: es.operators.crouzeix_raviart_laplacian(v.ball),
    "curl": lambda v: [es.calculus.curl(v.many, v.field), es.calculus.curl(v.many)],
    "curvature_tensors": lambda v: es.operators.curvature_tensors(v.animal, 2.0),
    "cut_by_planes": lambda v: es.scans.cut_by_planes(v.animal, [[0, 1, 0, 0.3]]),
    "decompose_field": lambda v: es.calculus.decompose_field(
        v.torus, es.calculus.gradient(v.torus, v.torus.vertices[:, 0])
    ),
    "decompose_one_form": lambda v: es.calculus.decompose_one_form(v.torus, v.form),
    "decompress_mesh": lambda v: es.spectral.decompress_mesh(v.packed.data),
    "default_codebook": lambda v: es.retrieval.default_codebook(),
    "default_energies": lambda v: es.spectral.default_energies(v.spectrum),
    "default_times": lambda v: es.spectral.default_times(v.spectrum),
    "deform": lambda v: es.deform(v.rig, v.region, v.move, fixed=v.fixed),
    "denoise": lambda v: es.operators.denoise(v.animal, reach=0.02),
    "describe": lambda v: [es.describe(v.animal), es.describe(v.animal, es.retrieval.SCALE_FREE)],
    "detailed_skeleton": lambda v: es.deformation.detailed_skeleton(v.binding).fine,
    "detect_watermark": lambda v: es.spectral.detect_watermark(
        v.animal, v.marked, ["a key", "another"], k=30
    ),
    "difference_regions": lambda v: [
        es.spectral.difference_regions(v.latent, 1, difference, kind)
        for kind in ("area", "conformal")
        for difference in v.latent.differences(kind)
    ],
    "dirichlet_laplacian": lambda v: es.operators.dirichlet_laplacian(
        v.laplacian, np.array([0, 5])
    ),
    "disc": lambda v: es.shapes.disc(4),
    "disc_eigenvalues": lambda v: es.shapes.disc_eigenvalues(9),
    "disjoint_union": lambda v: es.geometry.disjoint_union(v.ball, v.torus),
    "divergence": lambda v: [
        es.calculus.divergence(v.many, v.field),
        es.calculus.divergence(v.many),
    ],
    "draw": lambda v: es.plot.draw(v.ball, v.camera),
    "draw_thumbnail": lambda v: es.retrieval.draw_thumbnail(v.ball),
    "dual_volumes": lambda v: es.geometry.dual_volumes(v.many),
    "edge_graph": lambda v: es.operators.edge_graph(v.animal),
    "edge_lengths": lambda v: es.geometry.edge_lengths(v.many),
    "edge_table": lambda v: es.geometry.edge_table(v.animal),
    "eigen_deformation": lambda v: es.deformation.eigen_deformation(v.detailed, [v.handle]),
    "eigen_skeleton": lambda v: es.deformation.eigen_skeleton(v.rig, 9),
    "eigenspace_angles": lambda v: es.spectral.eigenspace_angles(v.many_spectrum, v.many_spectrum),
    "eigenspace_errors": lambda v: es.spectral.eigenspace_errors(
        v.many_spectrum,
        es.shapes.sphere_eigenvalues(9),
        es.shapes.sphere_harmonics(v.many.vertices, 4),
    ),
    "embed_watermark": lambda v: es.spectral.embed_watermark(v.animal, "a key", k=30),
    "enclosed_volume": lambda v: es.geometry.enclosed_volume(v.many),
    "enclosing_ball": lambda v: es.geometry.enclosing_ball(v.animal.vertices),
    "euler_characteristic": lambda v: es.geometry.euler_characteristic(v.animal),
    "export_bundle": lambda v: [
        es.spectral.export_bundle(v.bundle, form) for form in ("scipy", "numpy")
    ],
    "extend_scalar": lambda v: es.calculus.extend_scalar(v.by_vector_heat, [0, 9], [1.0, 5.0]),
    "extract_patches": lambda v: es.retrieval.extract_patches(v.torus, n_views=1),
    "face_areas": lambda v: es.geometry.face_areas(v.many),
    "face_normals": lambda v: es.geometry.face_normals(v.many),
    "facet_table": lambda v: es.geometry.facet_table(v.solid),
    "factor_equations": lambda v: es.calculus.factor_equations(
        v.laplacian.stiffness, fixed=[0], constraints=v.animal.vertices.T
    ),
    "farthest_points": lambda v: es.geometry.farthest_points(v.animal, 20),
    "fem_boundary_nodes": lambda v: es.operators.fem_boundary_nodes(v.grid),
    "fem_laplacian": lambda v: es.operators.fem_laplacian(v.solid, 3),
    "fem_nodes": lambda v: es.operators.fem_nodes(v.solid, 3),
    "fibonacci_sphere": lambda v: es.shapes.fibonacci_sphere(300),
    "figure_contact_sheet": lambda v: drawn(
        es.plot.figure_contact_sheet(
            es.plot.Panel(v.ball, "ball", np.zeros(v.ball.n_faces, int), np.array([0])), []
        )
    ),
    "figure_cortex": lambda v: drawn(
        es.plot.figure_cortex({"left": v.ball}, {"left": v.ball.vertices[:, 0]})
    ),
    "figure_diagram": lambda v: drawn(es.plot.figure_diagram(v.diagram)),
    "figure_eigenfunctions": lambda v: drawn(
        es.plot.figure_eigenfunctions(v.animal, v.spectrum, [1], camera=v.camera)
    ),
    "figure_field": lambda v: drawn(
        es.figure_field(v.ball, v.ball.vertices[:, 0], r"$x_1$", camera=v.camera)
    ),
    "figure_fields": lambda v: drawn(
        es.plot.figure_fields({"x": (v.ball, v.ball.vertices[:, 0])}, camera=v.camera)
    ),
    "figure_label_transfer": lambda v: drawn(
        es.plot.figure_label_transfer(v.labeled, v.pose, v.transfer)
    ),
    "figure_merge_tree": lambda v: drawn(es.plot.figure_merge_tree(v.tree)),
    "figure_poses": lambda v: drawn(
        es.plot.figure_poses(
            {"rest": v.ball}, np.linspace(0, 1, v.ball.n_vertices), camera=v.camera
        )
    ),
    "figure_segments": lambda v: drawn(
        es.figure_segments(v.ball, v.ball.faces[:, 0] % 3, np.array([0]), camera=v.camera)
    ),
    "figure_spectra": lambda v: drawn(
        es.plot.figure_spectra({"rest": v.spectrum, "pose": v.spectrum2})
    ),
    "figure_spectrum": lambda v: drawn(es.plot.figure_spectrum(v.spectrum)),
    "figure_stability": lambda v: drawn(es.plot.figure_stability(v.report, v.cloud, v.cloud)),
    "filter_values": lambda v: [
        es.spectral.filter_values(v.many.vertices, v.many_spectrum, response, keep_rest=True)
        for response in (
            lambda values: values <= 3.0,
            lambda values: np.exp(-0.1 * values),
        )
    ],
    "find_heat_features": lambda v: [
        es.retrieval.find_heat_features(v.animal),
        es.retrieval.find_heat_features(v.animal, accuracy=0.01),
    ],
    "find_items": lambda v: es.io.find_items(v.meshes),
    "PartDecomposition.smooth": lambda v: (found := es.find_parts(v.animal)).smooth(found.parts),
    "find_parts": lambda v: es.find_parts(v.animal).parts,
    "flat_torus_eigenvalues": lambda v: es.shapes.flat_torus_eigenvalues(9, np.eye(2)),
    "flatten_conformally": lambda v: es.calculus.flatten_conformally(v.grid),
    "from_arrays": lambda v: es.geometry.from_arrays(v.ball.vertices, v.ball.faces),
    "from_pyvista": lambda v: es.io.from_pyvista(es.io.to_pyvista(v.ball)),
    "from_trimesh": lambda v: es.io.from_trimesh(es.io.to_trimesh(v.ball)),
    "functional_laplacian": lambda v: (
        es.operators.functional_laplacian(es.geometry.shape_quadrature(v.animal), 0.01)
        @ v.animal.vertices[:, 0]
    ),
    "functional_map": lambda v: [
        es.functional_map(v.spectrum, v.spectrum2, [[0, 0], [99, 99]], n_modes=8),
        es.functional_map(
            v.spectrum,
            v.spectrum2,
            n_modes=8,
            descriptors="waves",
            meshes=(v.animal, v.pose),
        ),
    ],
    "gaussian_curvature": lambda v: es.geometry.gaussian_curvature(v.animal),
    "gaussian_laplacian": lambda v: es.operators.gaussian_laplacian(v.cloud.points, 0.02, 2),
    "geodesic_balls": lambda v: es.geometry.geodesic_balls(v.ball, 0.5),
    "geodesic_distances": lambda v: es.geometry.geodesic_distances(v.animal, [0, 9]),
    "uneven_sphere": lambda v: es.shapes.uneven_sphere(200),
    "geodesic_path": lambda v: es.calculus.geodesic_path(v.ball, 0, 99),
    "geodesic_waves": lambda v: es.geometry.geodesic_waves(v.ball)(0, 1.0),
    "gradient": lambda v: [
        es.calculus.gradient(v.many, v.many.vertices),
        es.calculus.gradient(v.many),
    ],
    "graph_laplacian": lambda v: es.operators.graph_laplacian(v.animal, "normalized"),
    "grid": lambda v: es.shapes.grid(3, 4),
    "harmonic_fields": lambda v: es.calculus.harmonic_fields(v.torus),
    "heat_descriptor": lambda v: es.retrieval.heat_descriptor(v.spectrum, v.parts.features),
    "skeleton_response": lambda v: es.deformation.skeleton_response(v.binding),
    "heat_distances": lambda v: [
        es.calculus.heat_distances(shape, [0, 9]) for shape in (v.ball, v.by_heat_flow)
    ],
    "heat_kernel": lambda v: es.spectral.heat_kernel(v.many_spectrum, [0, 9], None, 0.2),
    "heat_kernel_signature": lambda v: es.heat_kernel_signature(v.many_spectrum, [0.3]),
    "heat_trace": lambda v: es.spectral.heat_trace(v.many_spectrum, [0.5, 1.0]),
    "icosphere": lambda v: es.icosphere(2),
    "interval": lambda v: es.shapes.interval(9),
    "irregular_grid": lambda v: es.shapes.irregular_grid(4, 5, rng=rng()),
    "is_closed": lambda v: es.geometry.is_closed(v.animal),
    "is_manifold": lambda v: es.geometry.is_manifold(v.animal),
    "LatentBasis.differences": lambda v: v.latent.differences("conformal"),
    "LatentBasis.map_between": lambda v: v.latent.map_between(1, 0),
    "latent_basis": lambda v: es.spectral.latent_basis({(0, 1): v.map, (0, 2): v.map}),
    "level_set": lambda v: es.calculus.level_set(v.solid, v.solid.points[:, 0], 0.4),
    "local_triangles": lambda v: es.operators.local_triangles(v.cloud),
    "logarithmic_map": lambda v: [
        es.calculus.logarithmic_map(v.ball, 0, method=method)
        for method in ("affine", "adaptive", "radial")
    ],
    "make_creature": lambda v: es.make_creature("quadruped", 3, n_vertices=700),
    "map_from_points": lambda v: es.spectral.map_from_points(
        v.many_spectrum, v.many_spectrum, np.arange(v.many.n_vertices), n_modes=6
    ),
    "map_to_sphere": lambda v: es.calculus.map_to_sphere(v.ball, n_steps=9),
    "match_features": lambda v: es.retrieval.match_features(*v.by_heat),
    "match_patches": lambda v: es.retrieval.match_patches(
        *(descriptor.points[0] for descriptor in v.by_patches)
    ),
    "matching_reach": lambda v: es.stability.matching_reach(2.0),
    "matching_score": lambda v: es.retrieval.matching_score(*v.by_heat),
    "maximum_matching": lambda v: es.stability.maximum_matching(
        sp.csr_array(np.eye(5)[[4, 2, 0, 1, 3]])
    ),
    "mean_curvature": lambda v: es.operators.mean_curvature(v.many),
    "mean_curvature_flow": lambda v: es.calculus.mean_curvature_flow(v.animal, 0.001, n_steps=3),
    "mean_side_length": lambda v: es.geometry.mean_side_length(v.many),
    "measure_closeness": lambda v: es.stability.measure_closeness(v.change),
    "measure_distortion": lambda v: es.deformation.measure_distortion(v.animal, v.pose),
    "merge_targets": lambda v: es.features.merge_targets(v.tree),
    "merge_tree": lambda v: es.merge_tree(v.animal, v.heat[:, 0]),
    "mesh_laplacian": lambda v: [
        es.mesh_laplacian(v.torus, distance=d) for d in ("euclidean", "geodesic")
    ],
    "shape_quadrature": lambda v: [
        es.geometry.shape_quadrature(each) for each in (v.many, v.cloud)
    ],
    "move_skeleton": lambda v: es.deformation.move_skeleton(v.response, [v.handle]),
    "neighbor_graph": lambda v: es.operators.neighbor_graph(v.cloud.points, 6),
    "nodal_domains": lambda v: es.spectral.nodal_domains(v.many, v.height),
    "nodal_set": lambda v: es.spectral.nodal_set(v.many, v.height),
    "noise_level": lambda v: es.operators.noise_level(v.animal),
    "normalize_mesh": lambda v: [
        es.geometry.normalize_mesh(v.animal, measure) for measure in ("box", "area", "diameter")
    ],
    "normalized_cut": lambda v: es.spectral.normalized_cut(
        v.normalized, v.animal.vertices[:, 1] > 0
    ),
    "one_form_edges": lambda v: es.calculus.one_form_edges(v.many),
    "operator_bundle": lambda v: [
        es.spectral.operator_bundle(shape, 6) for shape in (v.ball, v.cloud)
    ],
    "orient_outward": lambda v: es.geometry.orient_outward(v.many),
    "part_colors": lambda v: es.plot.part_colors(v.animal, v.labels),
    "part_tree": lambda v: es.features.part_tree(v.animal, v.spectrum),
    "partial_scan": lambda v: es.partial_scan(v.many, [0, 0, 1], resolution=100),
    "patch_descriptor": lambda v: es.retrieval.patch_descriptor([v.patches[0]], v.recipe),
    "query_indexes": lambda v: es.retrieval.query_indexes(
        v.by_patches[0], [v.index.folder], n_matches=2
    ),
    "patch_scores": lambda v: es.retrieval.patch_scores(v.by_patches[0], v.by_patches),
    "persistence_diagram": lambda v: es.features.persistence_diagram(v.solid, v.solid.points[:, 0]),
    "measure_perturbation": lambda v: es.stability.measure_perturbation(v.ball, v.ball),
    "point_map": lambda v: es.spectral.point_map(v.map),
    "cloud_width": lambda v: es.operators.cloud_width(v.cloud),
    "pointwise_time": lambda v: es.operators.pointwise_time(v.many),
    "polyharmonic_matrix": lambda v: es.calculus.polyharmonic_matrix(v.laplacian, 3),
    "prepare_heat_geodesics": lambda v: es.calculus.prepare_heat_geodesics(v.ball),
    "prepare_vector_heat": lambda v: es.calculus.prepare_vector_heat(v.ball),
    "principal_curvatures": lambda v: es.geometry.principal_curvatures(v.animal),
    "project": lambda v: es.spectral.project(v.many.vertices, v.many_spectrum),
    "projective_plane": lambda v: es.shapes.projective_plane(1),
    "projective_plane_eigenvalues": lambda v: es.shapes.projective_plane_eigenvalues(9),
    "quadrature_laplacian": lambda v: es.operators.quadrature_laplacian(
        es.geometry.shape_quadrature(v.torus), 0.05
    ),
    "random_planes": lambda v: es.scans.random_planes(v.animal, rng()),
    "random_sphere": lambda v: es.shapes.random_sphere(90, rng=rng()),
    "read_codebook": lambda v: es.retrieval.read_codebook(v.bytes),
    "read_edits": lambda v: es.io.read_edits(v.folder / "edits.json", v.animal),
    "read_mesh": lambda v: es.read_mesh(v.folder / "ball.ply"),
    "read_surface": lambda v: es.io.read_surface(v.folder / "ball.ply"),
    "Allometry.shapes": lambda v: es.morphometrics.fit_allometry(
        v.skulls, [1.0, 2, 3, 4, 5]
    ).shapes([2.5]),
    "PrincipalComponents.shape": lambda v: es.morphometrics.principal_components(v.skulls).shape(
        [0.1]
    ),
    "ProcrustesFit.distances": lambda v: es.morphometrics.fit_procrustes(v.skulls).distances(),
    "ProcrustesFit.outliers": lambda v: es.morphometrics.fit_procrustes(v.skulls).outliers(),
    "compare_groups": lambda v: es.morphometrics.compare_groups(v.skulls, [0, 0, 0, 1, 1]),
    "estimate_missing": lambda v: es.morphometrics.estimate_missing(
        np.where(
            np.eye(5)[:, :, None] * (np.arange(5) == 2)[:, None, None], np.nan, v.skulls[:, :5]
        )
    ),
    "figure_landmarks": lambda v: drawn(es.plot.figure_landmarks(v.skulls[:, :9])),
    "figure_ordination": lambda v: drawn(
        es.plot.figure_ordination(v.skulls[:, 0], [0, 0, 0, 1, 1])
    ),
    "fit_allometry": lambda v: es.morphometrics.fit_allometry(v.skulls, [1.0, 2, 3, 4, 5]),
    "fit_procrustes": lambda v: es.morphometrics.fit_procrustes(
        v.skulls[:, :60], curves=[range(20)]
    ),
    "principal_components": lambda v: es.morphometrics.principal_components(v.skulls),
    "resample_curves": lambda v: es.morphometrics.resample_curves(
        es.morphometrics.Landmarks("abc", v.ball.vertices[v.ball.faces[0]], curves=[[0, 1, 2, 0]]),
        9,
        mesh=v.ball,
    ),
    "symmetric_components": lambda v: es.morphometrics.symmetric_components(v.skulls, [[0, 1]]),
    "warp_mesh": lambda v: es.morphometrics.warp_mesh(
        v.animal, v.animal.vertices[:20], v.pose.vertices[:20]
    ),
    "read_landmarks": lambda v: es.morphometrics.read_landmarks(v.folder / "skull.mrk.json"),
    "read_specimens": lambda v: es.morphometrics.read_specimens(v.folder / "skull.mrk.json"),
    "write_landmarks": lambda v: written(
        v.folder, ".csv", lambda path: es.morphometrics.write_landmarks({"a": v.skull}, path)
    ),
    "read_points": lambda v: es.io.read_points(v.folder / "cloud.ply"),
    "read_shape": lambda v: es.read_shape(v.folder / "square.mesh"),
    "reconstruct": lambda v: es.spectral.reconstruct(v.many_coefficients, v.many_spectrum),
    "recover_geometry": lambda v: es.spectral.recover_geometry(es.shapes.sphere_eigenvalues(300)),
    "refine_map": lambda v: [
        es.spectral.refine_map(v.many_map, 8, bijective=each) for each in (False, True)
    ],
    "reflection_free_signature": lambda v: es.spectral.reflection_free_signature(
        v.many_spectrum, v.many_spectrum, [0.3]
    ),
    "region_boundary": lambda v: es.deformation.region_boundary(v.animal, v.region),
    "region_mask": lambda v: es.deformation.region_mask(
        v.animal, es.deformation.BoxRegion([-1, 0, -1], [1, 1, 1])
    ),
    "remove_means": lambda v: es.calculus.remove_means(v.many_laplacian, v.many.vertices**2),
    "repair": lambda v: (
        [es.repair(v.animal, [name]) for name in MESH_REPAIRS]
        + [es.repair(v.grid, ["fill_holes"]), es.repair(v.cloud, ["drop_duplicate_points"])]
    ),
    "replay": lambda v: es.deformation.replay(v.rig, [v.edit]).mesh,
    "rig_shape": lambda v: es.rig_shape(v.many, v.many_spectrum).factor,
    "sample_surface": lambda v: es.geometry.sample_surface(v.animal, 50, rng=rng()),
    "save_figure": lambda v: [
        saved(v, ".png"),
        saved(v, ".pdf"),
        len(saved(v, ".svg")),
    ],  # random names in SVG
    "scale_invariant_signature": lambda v: es.spectral.scale_invariant_signature(v.many_spectrum),
    "segment": lambda v: es.segment(v.tree, n_regions=4),
    "self_intersections": lambda v: es.geometry.self_intersections(v.animal),
    "separated_groups": lambda v: es.spectral.separated_groups(v.spectrum.eigenvalues),
    "shape_difference": lambda v: es.spectral.shape_difference(v.map, "conformal"),
    "shape_dna": lambda v: es.spectral.shape_dna(v.animal),
    "signed_distance": lambda v: es.geometry.signed_distance(v.ball, v.animal.vertices),
    "signed_heat_distance": lambda v: es.calculus.signed_heat_distance(
        v.by_vector_heat, [v.animal.faces[0, [0, 1, 2, 0]]]
    ),
    "simplex_volumes": lambda v: es.geometry.simplex_volumes(v.solid),
    "simulate_scan": lambda v: es.scans.simulate_scan(
        v.ball, rng(), camera=es.scans.DepthCamera(resolution=40)
    ),
    "smooth_boundaries": lambda v: es.features.smooth_boundaries(v.animal, v.parts),
    "smooth_mesh": lambda v: es.spectral.smooth_mesh(
        v.animal, v.spectrum, lambda values: values <= 9.0, keep_volume=True
    ),
    "solve_harmonic": lambda v: [
        es.calculus.solve_harmonic(v.laplacian, [0, 9], [1.0, 2.0], order=order) for order in (1, 2)
    ],
    "solve_heat": lambda v: es.calculus.solve_heat(v.laplacian, v.animal.vertices, 0.01, n_steps=3),
    "solve_helmholtz": lambda v: es.calculus.solve_helmholtz(v.laplacian, -4.0, v.animal.vertices),
    "solve_poisson": lambda v: es.calculus.solve_poisson(
        v.laplacian, v.animal.vertices[:, 0], fixed=[0, 9], values=[1.0, 2.0]
    ),
    "solve_spectrum": lambda v: [
        es.solve_spectrum(v.laplacian, 40),
        es.solve_spectrum(v.laplacian, 5, fixed=np.array([0, 5])),
        es.solve_spectrum(v.many_laplacian, 3),
        cached(v),
    ],
    "spectral_clusters": lambda v: [
        es.spectral.spectral_clusters(v.graph_spectrum, 4, method=method)
        for method in ("k-means", "normalized-cut")
    ],
    "spectral_distances": lambda v: [
        es.spectral.spectral_distances(v.many_spectrum, [0, 9], method=method, t=t)
        for method, t in (("biharmonic", None), ("commute-time", None), ("diffusion", 0.2))
    ],
    "spectral_embedding": lambda v: es.spectral.spectral_embedding(
        v.many_spectrum, power=0.5, t=0.2
    ),
    "sphere_eigenvalues": lambda v: es.shapes.sphere_eigenvalues(9),
    "sphere_functional_eigenvalues": lambda v: es.shapes.sphere_functional_eigenvalues(9, 0.01),
    "sphere_harmonics": lambda v: es.shapes.sphere_harmonics(v.ball.vertices, 3),
    "subdivide": lambda v: [es.geometry.subdivide(v.solid), es.geometry.subdivide(v.ball)],
    "suggest_repairs": lambda v: es.suggest_repairs(v.animal),
    "surface_area": lambda v: es.geometry.surface_area(v.many),
    "tangent_frames": lambda v: es.operators.tangent_frames(v.animal),
    "taubin_smooth": lambda v: es.calculus.taubin_smooth(v.many),
    "theorem_rate": lambda v: es.stability.theorem_rate("lipschitz", 2),
    "three_sphere": lambda v: es.shapes.three_sphere(60),
    "to_pyvista": lambda v: np.asarray(es.io.to_pyvista(v.ball).points),
    "to_trimesh": lambda v: np.asarray(es.io.to_trimesh(v.ball).vertices),
    "torus": lambda v: es.shapes.torus(9, 7),
    "adjacent_parts": lambda v: es.features.adjacent_parts(v.animal, v.labels),
    "trace_geodesic": lambda v: es.calculus.trace_geodesic(v.ball, 0, [6.0, 0.5]),
    "train_codebook": lambda v: es.retrieval.train_codebook(v.animal_patches),
    "Similarity.move": lambda v: v.similarity.move(v.fish.vertices),
    "Similarity.inverse": lambda v: v.similarity.inverse().translation,
    "align_surfaces": lambda v: es.collections.align_surfaces(v.fish, v.fish),
    "fit_surface": lambda v: es.collections.fit_surface(v.fish, v.fish),
    "build_collection": lambda v: (
        es.collections.build_collection(v.bones, v.folder / secrets.token_hex(8)).points
    ),
    "open_collection": lambda v: es.collections.open_collection(v.collection.folder).points,
    "MeshAttributes.plain": lambda v: es.io.MeshAttributes.plain(v.ball),
    "Parcellation.require_vertices": lambda v: v.halves.require_vertices(v.animal.n_vertices),
    "Collection.number": lambda v: v.collection.number("two"),
    "Collection.read_placed": lambda v: v.collection.read_placed("two", v.collection.points[0]),
    "Collection.read_specimen": lambda v: v.collection.read_specimen("two"),
    "carry_landmarks": lambda v: es.collections.carry_landmarks(v.collection, {"one": v.tip}),
    "CarriedLandmarks.save": lambda v: written(
        v.folder, ".csv", es.collections.carry_landmarks(v.collection, {"one": v.tip}).save
    ),
    "Registration.move": lambda v: v.motion.move(v.fish.vertices),
    "Registration.inverse": lambda v: v.motion.inverse().rotation,
    "Registration.after": lambda v: v.motion.after(v.motion).rotation,
    "ShapeMatch.pull": lambda v: v.fish_match.pull(v.fish_pose.vertices),
    "ShapeMatch.save": lambda v: written(v.folder, ".npz", v.fish_match.save),
    "ShapeMatch.sure": lambda v: v.fish_match.sure(0.3),
    "match_shapes": lambda v: [
        es.match_shapes(v.fish, v.fish_target).weights,
    ],
    "register_scans": lambda v: es.matching.register_scans(v.fish, v.fish).rotation,
    "fuse_scans": lambda v: es.matching.fuse_scans([v.fish_scan]).mesh.vertices,
    "prepare_target": lambda v: es.matching.prepare_target(v.fish).area,
    "take_pose": lambda v: es.matching.take_pose(v.fish, v.fish_pose, match=v.fish_match),
    "figure_matches": lambda v: drawn(
        es.plot.figure_matches(
            v.ball,
            v.reader.query(v.by_patches[0]),
            meshes={"by patches 0": v.ball, "by patches 1": v.torus},
        )
    ),
    "figure_match": lambda v: drawn(es.plot.figure_match(v.fish, v.fish_pose, v.fish_match)),
    "transfer_deformation": lambda v: es.deformation.transfer_deformation(
        v.animal, v.pose, v.pose, v.map
    ),
    "transfer_function": lambda v: es.spectral.transfer_function(v.many_map, v.many.vertices),
    "labels_from_votes": lambda v: es.retrieval.labels_from_votes(
        v.animal, np.eye(v.animal.n_vertices)[:, :3], [4, 2, 7]
    ),
    "read_label_names": lambda v: es.io.read_label_names(v.labeled_folder),
    "read_labeled_shape": lambda v: (
        es.io.read_labeled_shape(v.labeled_folder / "animal.off").labels
    ),
    "read_labeled_shapes": lambda v: [
        shape.labels for shape in es.io.read_labeled_shapes(v.labeled_folder).values()
    ],
    "transfer": lambda v: es.matching.transfer(v.worn, es.icosphere(2)).places,
    "transfer_labels": lambda v: es.transfer_labels(v.labeled, v.pose),
    "admissible_times": lambda v: es.stability.admissible_times(
        delta=0.01, spacing=0.02, eigenvalue=9.0
    ),
    "transport_vectors": lambda v: es.calculus.transport_vectors(
        v.by_vector_heat, [0, 9], [[1.0, 0.0], [0.0, 1.0]]
    ),
    "value_colors": lambda v: es.plot.value_colors(v.heat[:, 0]),
    "vertex_components": lambda v: es.geometry.vertex_components(v.animal),
    "vertex_normals": lambda v: es.geometry.vertex_normals(v.many),
    "vertex_pairs": lambda v: es.stability.vertex_pairs(v.change),
    "wave_kernel_signature": lambda v: es.wave_kernel_signature(
        v.many_spectrum, es.spectral.default_energies(v.many_spectrum, 4)[0]
    ),
    "weyl_bound": lambda v: es.stability.weyl_bound(v.laplacian, v.other),
    "winding_numbers": lambda v: es.geometry.winding_numbers(v.animal, v.ball.vertices),
    "witness_region": lambda v: es.stability.witness_region(
        v.change, v.on_two, v.nodes.points, 0.5, rho=3.0
    ),
    "write_codebook": lambda v: es.retrieval.write_codebook(v.codebook),
    "write_edits": lambda v: written(
        v.folder, ".json", lambda path: es.io.write_edits([v.edit], v.animal, path)
    ),
    "write_mesh": lambda v: written(v.folder, ".ply", lambda path: es.write_mesh(v.animal, path)),
    "write_points": lambda v: written(
        v.folder, ".ply", lambda path: es.io.write_points(v.cloud, path)
    ),
}


def solved_like_lapy(mesh: es.TriangleMesh) -> list[np.ndarray]:
    """Return what all methods of the stand-in for LaPy's solver answer."""
    geometry = SimpleNamespace(v=mesh.vertices, t=mesh.faces)
    solver = es.compat.lapy.Solver(geometry, lump=True)
    mass = es.compat.lapy.Solver.fem_tria_mass(geometry)
    return [*solver.eigs(5), solver.poisson(mesh.vertices), mass.data]


CALLS |= {
    "accuracy_curve": lambda v: es.modes.accuracy_curve(v.animal.vertices, v.spectrum),
    "align_modes": lambda v: es.modes.align_modes(v.spectrum, v.spectrum2),
    "blood_response": lambda v: es.modes.blood_response(v.animal.vertices[:4], 0.1),
    "compare_modes": lambda v: es.modes.compare_modes(
        v.animal.vertices.T, v.pose.vertices.T, v.spectrum, n_permutations=5, rng=rng()
    ),
    "fit_modes": lambda v: es.modes.fit_modes(
        v.animal.vertices, v.spectrum, v.animal.vertices[:, 1] ** 2
    ),
    "geometric_connectome": lambda v: es.modes.geometric_connectome(v.spectrum, n_modes=30),
    "nodal_parcels": lambda v: es.modes.nodal_parcels(v.laplacian, 5),
    "ParcelTree.cut": lambda v: es.modes.nodal_parcels(v.laplacian, 5).cut(3),
    "rotation_nulls": lambda v: es.modes.rotation_nulls(
        v.animal.vertices, v.spectrum, 5, rng=rng(), residual="permute", resample="exact"
    ),
    "wave_response": lambda v: es.modes.wave_response(v.animal.vertices[:9], v.spectrum, 0.1),
}
CALLS["Solver"] = lambda v: solved_like_lapy(v.animal)


def call_of_operator(entry: es.operators.Operator) -> Callable[[Shared], object]:
    """Return a call that builds a registered operator on each shape that it takes."""
    return lambda v: [
        entry.build(shape)
        for shape in (v.animal, v.solid, v.cloud)
        if isinstance(shape, entry.shapes)
    ]


for _name, _entry in builders().items():
    CALLS.setdefault(_name, call_of_operator(_entry))

LEFT_OUT = {
    "cache_operator_bundles": "It starts processes, which take seconds to import.",
    "build_index": "It starts processes, which take seconds to import; it writes to an index, which admits one writer.",
    "install": "It replaces a class in all modules; so does uninstall.",
    "set_threads": "It sets one number for all threads; test_thread_count.py calls it.",
    "train_codebook_from_files": "It starts processes, which take seconds to import.",
    "uninstall": "As install.",
    "view": "It shows a widget of the studio, which is a package of its own.",
}
