"""Build a collection: fit a template to all specimens, then their mean."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar
from urllib.parse import quote

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type, require_unicode
from certeig.kit.errors import CerteigError, InvalidParameterError
from certeig.kit.files import as_path, content_digest
from certeig.kit.progress import Callback, ignore
from certeig.kit.threads import one_blas_thread
from eigenshape._errors import InvalidShapeError
from eigenshape._sealed import explained
from eigenshape._workers import Item, Outcome, Workers, run_in_workers
from eigenshape.collections.alignment import MIRROR, Side, Similarity, best_similarity
from eigenshape.collections.collection import (
    Collection,
    collection_of,
    export_collection,
    read_specimen,
    unreflect,
)
from eigenshape.collections.parts import (
    COLLECTION,
    DATABASE,
    SPECIMENS,
    exporting,
    keep_fit,
    read_fits,
    write_state,
)
from eigenshape.collections.sides import sides_of_landmarks
from eigenshape.collections.surface_fit import (
    LEVELS,
    SurfaceFit,
    bend_placed,
    fit_surface,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import repair, suggest_repairs
from eigenshape.geometry.resolution.decimation import decimate
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import vertex_components
from eigenshape.io.folders import find_items
from eigenshape.io.mesh_files import write_mesh
from eigenshape.morphometrics.landmarks import Landmarks, require_same_names
from eigenshape.morphometrics.procrustes import fit_procrustes

T = TypeVar("T")

N_FACES = 20_000  # of the template
DIGITS = 16  # of a digest in the name of a file
# The second round starts in so many modes of the first, which smooths over what single fits did
# wrong, and bends in the last three levels: in the last one with as many points as the template has
# faces, and in more rounds. Landmarks of one skull are 0.176 mm off then; with 6,000 points and four
# rounds, 0.182. All was chosen on the tuning half of experiments/ch7_collection.
N_MODES = 8
SECOND_LEVELS = tuple(
    level._replace(n_rounds=n_rounds) for level, n_rounds in zip(LEVELS[1:], (4, 4, 6), strict=True)
)
# Share of area that a specimen lacks, or has beyond the template, from which it is noted. One that
# lacks more gives no evidence for the mean.
NOTABLE = 0.1
# Share of area from which a piece that does not touch the largest one is noted: crumbs of 51 scanned
# skulls (`data/mice`) have up to 0.0017 each, and the screws of a machine part 0.0028.
LOOSE = 0.005
OTHER_UNIT = 3.0  # factor from the median size from which a unit is suspected
RECIPE = "4"  # changes when fits of an older version must not be used again
SURE = 0.25  # confidence of a vertex that determines where the second round starts
ROUNDS = 20  # of finding the place and the shape of a start in turn


@one_blas_thread()
def build_collection(
    specimens: str | Path | Mapping[str, str | Path | MeshLike],
    folder: str | Path,
    *,
    template: str | None = None,
    mirrored: bool | Mapping[str, Landmarks] = True,
    workers: Workers | None = None,
    callback: Callback | None = None,
) -> Collection:
    """Bring specimens of one kind into dense correspondence, and compute their mean shape.

    1. A template is bent onto each specimen (`fit_surface`), from the surfaces alone.
    2. All fits are superimposed (generalized Procrustes analysis). Their mean is the template of a
       second round, so that the choice of the first one hardly matters. Each specimen starts from
       its first fit in the 8 largest modes of the collection. The last step compares as many points
       as the template has faces.

    What is done is kept in one file of the folder, collection.sqlite. After Ctrl-C or a crash the
    same call goes on where it stopped, and until it has ended, the folder holds the last collection
    that was finished. Surfaces that have not changed are not fitted again. A specimen that cannot be
    read or placed is reported, and the others go on.

    Parameters
    ----------
    specimens : path, or mapping of str to path or MeshLike
        A folder whose files are read as by `es.io.read_surface`, or specimens by name: at least two
        surfaces of one form, such as bones, hands or cortices, in any unit and turned in any way.
        Parts may be missing or in excess.
    folder : str or Path
        Where the collection is kept; it is made where it is missing.
    template : str, optional
        Name of a complete specimen. By default that of the collection in the folder, or of a new
        one the specimen with the median area.
    mirrored : bool or mapping of str to Landmarks
        Whether a specimen may be a mirror image of another. If it is False, none is tried. Where
        both sides of the form are alike, surfaces do not tell, and landmarks do: the same ones on
        two or more specimens.
    workers : Workers, optional
        Processes, or the tasks of a cluster, that fit files side by side. By default all work is
        done by this process; `es.retrieval.Workers()` uses all cores.
    callback : callable, optional
        Called as callback(n_done, n_steps, name, error or None); each specimen has three steps: to
        read it, and two fits.

    Returns
    -------
    Collection
        `failures` names the specimens that are not in it, and why; `notes` what was noticed.

    Raises
    ------
    InvalidParameterError
        If there are fewer than two specimens, or none has the name of the template.
    InvalidShapeError
        If fewer than two specimens can be fitted.
    StoreError
        If the folder cannot be written, or its disk is full. What was done is kept.
    CerteigError
        If no worker can start. A script must call this under ``if __name__ == "__main__":``, since
        workers import the script.

    See Also
    --------
    carry_landmarks : Landmarks of some specimens, transferred to all.
    open_collection : Open it later.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> hands = {
    ...     f"hand {i}": es.make_creature("hand", individual=i, n_vertices=600) for i in range(3)
    ... }
    >>> collection = es.collections.build_collection(hands, mkdtemp())
    >>> collection.names, collection.failures
    (('hand 0', 'hand 1', 'hand 2'), {})
    >>> collection.points.shape == (3, collection.mean.n_vertices, 3)
    True
    """
    folder = as_path(folder, "folder")
    require_type(workers, Workers | None, "workers")
    items = _find_specimens(specimens, folder)
    if len(items) < 2:
        raise InvalidParameterError(
            f"A collection must have at least two specimens; there are {len(items)}. "
            "Name the folder in which they lie, and another one for the collection."
        )
    names = {item.name for item in items}
    if template is not None and template not in names:
        raise InvalidParameterError(
            f"The template must be a specimen; there is none named {template!r}."
        )
    labelled = _checked_landmarks(mirrored, names)
    with explained(COLLECTION, folder / DATABASE):
        folder.mkdir(parents=True, exist_ok=True)
    run = _Run(folder, workers, callback, len(items))

    found = run.over(items, _measure_file)
    items = [item for item in items if item.name in found]
    run.require_two(found)
    if template is None:
        order = sorted(items, key=lambda item: (found[item.name].area, item.name))
        # Another template would discard all fits when a specimen is added.
        template = run.template if run.template in found else order[len(order) // 2].name
    if template in run.failures:
        raise InvalidShapeError(f"The template must be readable. {run.failures[template]}")

    digests = {measured.path: measured.digest for measured in found.values()}
    surface, repairs = _template_surface(found[template].path, digests)
    readable = {name: points for name, points in labelled.items() if name in found}
    told = sides_of_landmarks(readable, template)
    known = False if mirrored is False else None
    keys = {
        name: _key(surface.vertices, surface.faces, known, told.get(name), measured.surface)
        for name, measured in found.items()
    }
    sides = {found[name].path: is_mirrored for name, is_mirrored in told.items()}
    work = partial(_fit_file, digests, surface, known, sides)
    fits = run.fit(items, work, "first", keys)
    run.require_two(fits)

    starts, modes = _starts_from_modes(fits)
    # The modes of others do not span another pose: such a specimen keeps its first fit.
    posed = {name: fit for name, fit in fits.items() if fit.method == "intrinsic"}
    again = [item for item in items if item.name in fits.keys() - posed.keys()]
    mean = _key(surface.faces, modes)
    keys = {}
    for name, start in starts.items():
        place = vars(start.placing).values()
        keys[name] = _key(mean, start.side, start.coefficients, *place, found[name].surface)
    by_path = {item.path: starts[item.name] for item in again}
    work = partial(_fit_again, digests, surface.faces, modes, by_path)
    fits = run.fit(again, work, "last", keys) | posed
    run.require_two(fits)
    return _collect(run, template, surface.faces, fits, found, repairs)


def _collect(
    run: "_Run",
    template: str,
    faces: Int[np.ndarray, "f 3"],
    fits: Mapping[str, SurfaceFit],
    found: Mapping[str, "_Measured"],
    repairs: Sequence[str],
) -> Collection:
    """Make a collection of the last fits, and write it to its folder."""
    ordered = {name: fits[name] for name in sorted(fits)}
    reflected = tuple(fit.reflected for fit in ordered.values())
    points = np.stack([fit.vertices for fit in ordered.values()])
    complete = _complete(list(ordered.values()))
    together = fit_procrustes(unreflect(points, reflected)[complete])
    size = float(np.median(together.sizes))
    mean = TriangleMesh(together.mean * size, faces)
    rows = []
    for name, fit in ordered.items():
        notes = [*found[name].report, *_noticed(fit, size)]
        if name == template and repairs:
            notes.append(f"as the template: {'; '.join(repairs)}")
        rows.append(
            {
                "name": name,
                "key": run.keys[name],
                "source": str(found[name].path.absolute()),
                "digest": found[name].digest,
                "notes": notes,
            }
        )
    failures = dict(sorted(run.failures.items()))
    facts = {"template": template, "specimens": rows, "failures": failures}
    write_state(run.folder, facts, mean, list(ordered.values()), run.used)
    collection = collection_of(run.folder, facts, mean, list(ordered.values()))
    with exporting(run.folder, facts) as is_last:
        if is_last:  # of two builds at once
            export_collection(collection)
    return collection


@dataclass(frozen=True)
class _Measured:
    """What is known of a specimen before it is fitted, with digests of its file and its surface."""

    path: Path
    digest: str
    surface: str
    area: float
    report: tuple[str, ...]


@dataclass(frozen=True)
class _Start:
    """Where the second fit of a specimen starts: a shape in modes, its place, and its side."""

    coefficients: Float[np.ndarray, " q"]
    placing: Similarity
    side: Side


class _Run:
    """The steps of all specimens: in workers or here, with what failed."""

    def __init__(
        self, folder: Path, workers: Workers | None, callback: Callback | None, n_items: int
    ) -> None:
        self.folder, self.workers = folder, workers
        self.callback = callback or ignore
        self.n_items, self.n_done, self.n_rounds = n_items, 0, 0
        self.failures: dict[str, str] = {}
        self.kept, self.template = read_fits(folder)
        self.keys: dict[str, str] = {}  # of the last fit of each specimen
        self.used: set[str] = set()  # keys of all fits of this run

    def over(self, items: Sequence[Item], work: Callable[[Path], T]) -> dict[str, T]:
        """Return what work makes of each item, by name, as far as it does not fail."""
        self._begin(len(items))
        return dict(self._results(items, work))

    def fit(
        self,
        items: Sequence[Item],
        work: Callable[[Path], SurfaceFit],
        kind: str,
        keys: Mapping[str, str],
    ) -> dict[str, SurfaceFit]:
        """Return the fit of each item by its key, from the folder if it is there."""
        self._begin(len(items))
        self.keys |= {item.name: keys[item.name] for item in items}
        self.used |= set(keys.values())
        fits = {item.name: self.kept.get(keys[item.name]) for item in items}
        for name in [name for name, fit in fits.items() if fit is not None]:
            self._done(name, None)
        for name, fit in self._results([item for item in items if fits[item.name] is None], work):
            keep_fit(self.folder, keys[name], kind, name, fit)
            fits[name] = fit
        return {name: fit for name, fit in fits.items() if fit is not None}

    def _results(self, items: Sequence[Item], work: Callable[[Path], T]) -> Iterator[tuple[str, T]]:
        if self.workers is None:
            outcomes = ((item, _outcome(work, item.path)) for item in items)
        else:
            outcomes = run_in_workers(work, items, self.workers)
        with closing(outcomes):
            for item, outcome in outcomes:
                if outcome.value is None:
                    self.failures[item.name] = str(outcome.error)
                else:
                    yield item.name, outcome.value
                self._done(item.name, outcome.error)

    def _begin(self, n_left: int) -> None:
        """Begin a round; the steps of what has failed before count as done."""
        self.n_rounds += 1
        self.n_done = self.n_rounds * self.n_items - n_left

    def _done(self, name: str, error: str | None) -> None:
        self.n_done += 1
        self.callback(self.n_done, 3 * self.n_items, name, error)

    def require_two(self, found: Mapping[str, object]) -> None:
        """Raise an error if too few specimens are left."""
        if len(found) < 2:
            name, reason = next(iter(self.failures.items()))
            raise InvalidShapeError(
                f"At least two specimens must be readable and fit; {len(found)} did. {name}: {reason}"
            )


def _outcome(work: Callable[[Path], T], path: Path) -> Outcome[T]:
    try:
        return Outcome(work(path))
    except (CerteigError, OSError) as err:
        return Outcome(error=str(err))


def _find_specimens(
    specimens: str | Path | Mapping[str, str | Path | MeshLike], folder: Path
) -> list[Item]:
    """Return the files of specimens; meshes in memory are written to the folder first."""
    if not isinstance(specimens, Mapping):
        own = folder.absolute()
        found = find_items(as_path(specimens, "specimens"))
        return [item for item in found if own not in item.path.absolute().parents]
    items = []
    for name, value in specimens.items():
        require_unicode(name, "Names of specimens")
        if isinstance(value, str | Path):
            path = as_path(value)
        else:
            mesh = as_mesh(value, f"specimens[{name!r}]")
            # The surfaces of the finished collection stay, also if this build is stopped.
            digest = _key(mesh.vertices, mesh.faces)[:DIGITS]
            path = folder / SPECIMENS / f"{quote(name, safe=' ')} {digest}.ply"
            path.parent.mkdir(parents=True, exist_ok=True)
            with explained(COLLECTION, folder / DATABASE):
                write_mesh(mesh, path)
        items.append(Item(name, path))
    return items


def _checked_landmarks(
    mirrored: bool | Mapping[str, Landmarks], names: set[str]
) -> Mapping[str, Landmarks]:
    if isinstance(mirrored, bool):
        return {}
    require_type(mirrored, Mapping, "mirrored")
    for name in mirrored:
        if name not in names:
            raise InvalidParameterError(f"Landmarks must be of specimens; {name!r} is none.")
    if mirrored:
        require_same_names(mirrored, "mirrored")
    return mirrored


def _measure_file(path: Path) -> _Measured:
    digest = content_digest(path)
    mesh, report = read_specimen(path)
    total = surface_area(mesh)
    areas = np.sort(np.bincount(vertex_components(mesh)[1], dual_volumes(mesh)))
    report += tuple(
        f"a separate piece has {area / total:.1%} of its area"
        for area in areas[-2::-1]
        if area > LOOSE * total
    )
    return _Measured(path, digest, _key(mesh.vertices, mesh.faces), total, report)


def _read_measured(path: Path, digests: Mapping[Path, str]) -> TriangleMesh:
    """Read a specimen that must be as it was measured."""
    mesh = read_specimen(path)[0]
    if content_digest(path) != digests[path]:
        raise InvalidShapeError(
            f"A file must not change while it is fitted; {path} has. Build the collection again."
        )
    return mesh


def _template_surface(
    path: Path, digests: Mapping[Path, str]
) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Return a sound surface of at most `N_FACES` faces, and what was repaired."""
    mesh = _read_measured(path, digests)
    done = repair(mesh, suggest_repairs(mesh))
    mesh = done.mesh
    return decimate(mesh, N_FACES).mesh if mesh.n_faces > N_FACES else mesh, done.report


def _fit_file(
    digests: Mapping[Path, str],
    source: TriangleMesh,
    mirrored: bool | None,
    told: Mapping[Path, bool],
    path: Path,
) -> SurfaceFit:
    """Fit the template to a file; where its surface tells no side, landmarks may have told it."""
    target = _read_measured(path, digests)
    fit = fit_surface(source, target, mirrored=mirrored)
    if fit.side != "cannot be told" or path not in told:
        return fit
    return fit_surface(source, target, mirrored=True) if told[path] else replace(fit, side="same")


def _fit_again(
    digests: Mapping[Path, str],
    faces: np.ndarray,
    modes: np.ndarray,
    starts: Mapping[Path, _Start],
    path: Path,
) -> SurfaceFit:
    start = starts[path]
    source = TriangleMesh(np.tensordot(start.coefficients, modes, 1), faces)
    target = _read_measured(path, digests)
    *coarse, fine = SECOND_LEVELS
    fine = fine._replace(n_points=max(fine.n_points, len(faces)))
    fit = bend_placed(source, start.placing.inverse(), target, (*coarse, fine))
    return replace(fit, side=start.side)


def _key(*inputs: object) -> str:
    """Return a digest of what something is made of."""
    found = hashlib.sha256(RECIPE.encode())
    for value in inputs:
        data = value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode()
        found.update(b"%d " % len(data) + data)
    return found.hexdigest()


def _complete(fits: Sequence[SurfaceFit]) -> np.ndarray:
    """Return which fits have all of the template; all of them if fewer than two have."""
    is_complete = np.array([fit.missing < NOTABLE for fit in fits])
    return is_complete if is_complete.sum() >= 2 else np.ones(len(fits), dtype=bool)


def _starts_from_modes(
    fits: Mapping[str, SurfaceFit],
) -> tuple[dict[str, _Start], Float[np.ndarray, "q n 3"]]:
    """Return starts of the second round, and the mean with the modes that they are in."""
    ordered = list(fits.values())
    reflected = tuple(fit.reflected for fit in ordered)
    points = unreflect(np.stack([fit.vertices for fit in ordered]), reflected)
    complete = _complete(ordered)
    together = fit_procrustes(points[complete])
    away = (together.shapes - together.mean).reshape(len(together.shapes), -1)
    _, lengths, right = np.linalg.svd(away, full_matrices=False)
    modes = np.vstack([together.mean.ravel(), right[:N_MODES]]).reshape(-1, *points.shape[1:])
    deviations = lengths[:N_MODES] / np.sqrt(len(away) - 1)
    starts = {}
    for name, fit, own in zip(fits, ordered, points, strict=True):
        sure = np.ones(len(own), dtype=bool)
        if fit.missing >= NOTABLE:
            sure = fit.confidence >= SURE
        coefficients, placing = _fit_modes(own, sure, modes, deviations)
        if fit.reflected:
            placing = Similarity(
                placing.scale, MIRROR @ placing.rotation, MIRROR @ placing.translation
            )
        starts[name] = _Start(coefficients, placing, fit.side)
    return starts, modes


def _fit_modes(
    points: Float[np.ndarray, "n 3"],
    sure: np.ndarray,
    modes: Float[np.ndarray, "q n 3"],
    deviations: Float[np.ndarray, " p"],
) -> tuple[Float[np.ndarray, " q"], Similarity]:
    """Return the shape in modes nearest to the sure points, and the similarity that places it there.

    Place and shape are computed in turn. Where points are missing, the others and the deviations of
    the modes determine the shape.
    """
    weights = sure.astype(np.float64)
    basis = modes[1:, sure].reshape(len(modes) - 1, -1)
    penalty = np.diag(np.mean(deviations**2) / np.maximum(deviations**2, 1e-300)) * 1e-3
    coefficients = np.concatenate([[1.0], np.zeros(len(basis))])
    for _ in range(ROUNDS):
        placing = best_similarity(np.tensordot(coefficients, modes, 1), points, weights)
        away = placing.inverse().move(points)[sure] - modes[0, sure]
        coefficients[1:] = np.linalg.solve(basis @ basis.T + penalty, basis @ away.ravel())
    return coefficients, best_similarity(np.tensordot(coefficients, modes, 1), points, weights)


def _noticed(fit: SurfaceFit, usual_size: float) -> list[str]:
    """Return what a person should know of a specimen."""
    found = []
    centered = fit.vertices - fit.vertices.mean(axis=0)
    factor = float(np.linalg.norm(centered)) / usual_size
    if not 1 / OTHER_UNIT < factor < OTHER_UNIT:
        found.append(
            f"its size is {factor:.3g} times the median: perhaps its unit of length is another one"
        )
    if fit.reflected:
        found.append("it is a mirror image of the others")
    if fit.missing > NOTABLE:
        found.append(f"{fit.missing:.0%} of the mean shape has no counterpart in it")
    if fit.excess > NOTABLE:
        found.append(f"{fit.excess:.0%} of its area has no counterpart in the mean shape")
    if fit.method == "intrinsic":
        found.append("its pose differs: the map is by intrinsic evidence (match_shapes)")
    return found
