"""Patches in an index: codebooks, codes and answers."""

from functools import partial

import numpy as np
import pytest
from describers import keep

import eigenshape as es
from eigenshape.retrieval.building import batch
from eigenshape.retrieval.kinds import describe_to_store, recipe_from_text, recipe_to_text
from eigenshape.retrieval.patches.codebook import CLIP, encode_patches, round_codes
from eigenshape.retrieval.patches.patches import surface_patches

KINDS = ("quadruped", "hand", "octopus", "biped")


@pytest.fixture(scope="module")
def recipe():
    return es.retrieval.PatchRecipe()


@pytest.fixture(scope="module")
def meshes():
    return {kind: es.make_creature(kind, 1, n_vertices=1200) for kind in KINDS}


@pytest.fixture(scope="module")
def index(recipe, meshes, tmp_path_factory):
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("patches") / "index")
    for kind, mesh in meshes.items():
        index.add(kind, mesh, recipe=recipe, n_views=2, label=kind)
    return index


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_scan_of_another_pose_finds_its_kind(index, recipe, kind):
    pose = es.make_creature(kind, 2, n_vertices=1500)
    scan = es.partial_scan(pose, np.array([0.3, 0.5, 0.8])).mesh
    for shape in (pose, scan):
        assert index.query(es.describe(shape, recipe))[0].name == kind


@pytest.mark.long
def test_a_noisy_scan_finds_both_poses_of_its_kind_first():
    index = es.ShapeIndex.create(None)
    for kind in ("biped", "octopus", "fish"):
        for pose in range(2):
            mesh = es.make_creature(kind, pose, n_vertices=1000)
            index.add(f"{kind} {pose}", mesh, label=kind)
    rng = np.random.default_rng(1)
    seen = es.partial_scan(es.make_creature("octopus", 7, n_vertices=1000), rng).mesh
    noise = 0.2 * es.geometry.edge_lengths(seen).mean() * rng.standard_normal(seen.vertices.shape)
    scan = es.TriangleMesh(seen.vertices + noise, seen.faces)
    best, second, other = index.query(scan, n_matches=3)
    assert [best.label, second.label] == ["octopus"] * 2
    assert best.score < second.score < other.score
    assert len(best.correspondences) > 10


@pytest.mark.long
def test_a_shape_finds_itself_nearly_at_zero(index, recipe, meshes):
    best, other = index.query(es.describe(meshes["hand"], recipe), n_matches=2)
    assert (best.name, best.view) == ("hand", 0)
    assert best.score < 0.05
    assert other.score > 0.3
    points = best.correspondences
    assert len(points) > 100
    assert np.array_equal(points[:, 0], points[:, 1])
    assert np.array_equal(best.vertices, es.describe(meshes["hand"], recipe).vertices)


@pytest.mark.long
def test_an_index_scores_as_the_function_does(index, recipe, meshes):
    kept = [describe_to_store(meshes[kind], recipe, 2)[0] for kind in sorted(KINDS)]
    query = es.describe(es.partial_scan(meshes["biped"], np.array([1.0, 0.2, 0.1])).mesh, recipe)
    found = {match.name: match.score for match in index.query(query)}
    assert [found[kind] for kind in sorted(KINDS)] == pytest.approx(
        es.retrieval.patch_scores(query, kept), abs=1e-6
    )


@pytest.mark.long
def test_rounding_hardly_turns_a_code(recipe, meshes):
    codes = encode_patches(surface_patches(meshes["octopus"]), recipe.codebook)
    whole = round_codes(codes, CLIP).astype(float)
    assert abs(whole).max() == 7
    assert (whole * codes).sum(axis=2) == pytest.approx(np.linalg.norm(whole, axis=2), rel=0.05)


@pytest.mark.parametrize("clip", [0.0, -1.0, np.inf, np.nan])
def test_a_clip_is_positive_and_finite(clip):
    with pytest.raises(es.InvalidParameterError, match="clip must be positive and finite; it is"):
        es.retrieval.PatchRecipe(clip=clip)


def test_another_clip_is_another_recipe(recipe):
    other = es.retrieval.PatchRecipe(clip=0.05)
    assert other != recipe
    assert recipe_from_text(*recipe_to_text(other)) == other


def test_a_codebook_survives_the_file_and_the_index(index, recipe):
    again = es.retrieval.read_codebook(es.retrieval.write_codebook(recipe.codebook))
    assert (again, again.digest) == (recipe.codebook, recipe.codebook.digest)
    assert es.retrieval.write_codebook(again) == es.retrieval.write_codebook(recipe.codebook)
    assert index.recipes() == [recipe]
    assert index.records()[0].recipes == (recipe,)
    assert index.descriptors("hand", recipe)[0].recipe == recipe


def with_other_codebook(book):
    return es.retrieval.PatchRecipe(
        es.retrieval.PatchCodebook(
            **{**vars(book), "means": np.asarray(book.means + 1, dtype=np.float32)}
        )
    )


@pytest.mark.long
def test_another_codebook_is_another_recipe(index, recipe, meshes):
    query = es.describe(
        meshes["hand"],
        with_other_codebook(
            es.retrieval.read_codebook(es.retrieval.write_codebook(recipe.codebook))
        ),
    )
    message = (
        rf"holds patches {recipe.codebook.digest[:8]}, and PatchRecipe\(codebook=PatchCodebook\("
    )
    with pytest.raises(es.StoreError, match=message):
        index.query(query)
    with pytest.raises(es.StoreError, match=r"holds patches .*, and HeatRecipe.* was requested"):
        index.query(es.describe(meshes["hand"], es.retrieval.SCALE_FREE))


@pytest.mark.long
def test_an_index_keeps_heat_and_patches_side_by_side(tmp_path, recipe, meshes):
    index = es.ShapeIndex.create(tmp_path / "both")
    index.keep_recipe(recipe)
    assert (index.recipes(), len(index)) == ([recipe], 0)
    for kind in KINDS[:2]:
        shapes = [es.describe(meshes[kind], one) for one in (recipe, es.retrieval.SCALE_FREE)]
        keep(index, kind, shapes)
    assert index.recipes() == [recipe, es.retrieval.SCALE_FREE]
    for one in index.recipes():
        assert index.query(es.describe(meshes["hand"], one))[0].name == "hand"


def read_known(path, *, meshes):
    if path.stem == "bad":
        raise es.InvalidShapeError("A face must have area; face 3 has none.")
    return meshes[path.stem]


def files(folder, names):
    for name in names:
        (folder / f"{name}.ply").touch()
    return [es.retrieval.Item(name, folder / f"{name}.ply") for name in names]


@pytest.mark.long
def test_a_codebook_is_learned_from_files_in_any_order(tmp_path, meshes, monkeypatch):
    monkeypatch.setattr(batch, "FEWEST_TO_TRAIN", 3)
    items, calls = files(tmp_path, [*KINDS, "bad"]), []
    train = partial(es.retrieval.train_codebook_from_files, read=partial(read_known, meshes=meshes))
    book = train(items, callback=lambda *call: calls.append(call))
    assert book == train(items[::-1], workers=es.retrieval.Workers(1))
    assert book != es.retrieval.default_codebook()
    assert [call[:2] for call in calls] == [(done, 5) for done in range(1, 6)]


@pytest.mark.long
def test_few_shapes_take_the_default_codebook(tmp_path, meshes, monkeypatch):
    train = partial(es.retrieval.train_codebook_from_files, read=partial(read_known, meshes=meshes))
    assert train(files(tmp_path, KINDS)) == es.retrieval.default_codebook()
    monkeypatch.setattr(batch, "FEWEST_TO_TRAIN", 3)
    some = files(tmp_path, ["hand", "bad", "biped"])
    assert train(some) == es.retrieval.default_codebook()


def test_odd_queries_are_answered_or_named(index, recipe):
    square = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]], [[0, 1, 2], [0, 2, 3]])
    assert len(index.query(es.describe(square, recipe))) == len(KINDS)
    hand = es.make_creature("hand", 2, n_vertices=1200)
    twice = np.concatenate([hand.vertices, hand.vertices + np.array([5, 0, 0])])
    pair = es.TriangleMesh(twice, np.concatenate([hand.faces, hand.faces + hand.n_vertices]))
    assert len(index.query(es.describe(pair, recipe))) == len(KINDS)
    sliver = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]], [[0, 1, 2]])
    with pytest.raises(es.InvalidShapeError, match="area"):
        es.describe(sliver, recipe)
    loose = es.TriangleMesh([*square.vertices, [9, 9, 9]], square.faces)
    with pytest.raises(es.InvalidShapeError, match="vertex 4"):
        es.describe(loose, recipe)


def test_a_coarse_mesh_finds_its_shape_among_fine_ones():
    """Discs hold few vertices of a coarse mesh: their points were unlike those of the same surface, subdivided."""
    index = es.ShapeIndex.create(None)
    fine = {kind: es.make_creature(kind, n_vertices=4000) for kind in ("quadruped", "giraffe")}
    for kind, mesh in fine.items():
        index.add(kind, mesh, n_views=0)
    coarse = es.geometry.decimate(fine["quadruped"], 500).mesh
    found = index.query(coarse, n_matches=2)
    assert found[0].name == "quadruped"
    assert found[0].score < 0.2
    assert not found.nothing_alike


def test_a_mesh_and_its_subdivision_have_the_same_codes():
    coarse = es.geometry.decimate(es.make_creature("hand", n_vertices=500), 150).mesh
    one, two = (
        es.describe(each).codes[0].ravel() for each in (coarse, es.geometry.subdivide(coarse))
    )
    alike = (
        one.astype(float)
        @ two
        / np.linalg.norm(one.astype(float))
        / np.linalg.norm(two.astype(float))
    )
    assert alike > 0.9
