"""A collection of specimens in dense correspondence, and the folder that it is kept in."""

import json
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import ReadOnly, record
from eigenshape._errors import InvalidParameterError, InvalidShapeError, StoreError
from eigenshape._files import as_path, replace_file, replacing
from eigenshape.collections.alignment import MIRROR, Side
from eigenshape.collections.spread_points import main_pieces
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward, outward_vote
from eigenshape.geometry.repairs.repair import repair
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.io.surface_files import read_surface
from eigenshape.morphometrics.landmark_files import csv_text

VERSION = 2  # of the folder's layout
TABLE, MEAN, SPECIMENS = "collection.json", "mean.ply", "specimens.csv"


@record
class Collection(ReadOnly):
    """Specimens in dense correspondence with their mean, as `build_collection` makes them.

    Attributes
    ----------
    folder : Path
        Where it is kept.
    names : tuple of str
        Of the s specimens that could be fitted, sorted.
    mean : TriangleMesh
        The mean shape, of mean size, with n vertices.
    points : (s, n, 3) float
        The place of each vertex of the mean on each specimen, in the frame and unit of its file.
    gaps : (s, n) float
        Distance of each place to the specimen's surface, in its unit.
    confidence : (s, n) float
        0 to 1, as of `SurfaceFit`: low where the specimen has no such place.
    sides : tuple of str
        Whether each specimen is a mirror image of the template's kind: "same", "mirrored" or "cannot
        be told", if both sides of the form are alike; it counts as "same" then, and if it is a
        mirror image, its left and right are exchanged.
    methods : tuple of str
        How each was reached: by "position", or by "intrinsic" evidence (`match_shapes`), since its
        pose differs.
    sources : tuple of Path
        The file of each specimen.
    template : str
        The specimen that was fitted to all others first.
    notes : dict of str to tuple of str
        By name, what was noticed or done: another unit, missing or surplus parts, other poses,
        reflections, repairs.
    failures : dict of str to str
        By name, why a specimen is not in the collection.

    See Also
    --------
    build_collection, open_collection, carry_landmarks

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> import eigenshape as es
    >>> fish = [es.make_creature("fish", individual=i, n_vertices=500) for i in (0, 1)]
    >>> collection = es.collections.build_collection(dict(zip("ab", fish)), mkdtemp())
    >>> collection.number("b"), collection.points.shape == (2, collection.mean.n_vertices, 3)
    (1, True)
    """

    folder: Path
    names: tuple[str, ...]
    mean: TriangleMesh
    points: Float[np.ndarray, "s n 3"]
    gaps: Float[np.ndarray, "s n"]
    confidence: Float[np.ndarray, "s n"]
    sides: tuple[Side, ...]
    methods: tuple[Literal["position", "intrinsic"], ...]
    sources: tuple[Path, ...]
    template: str
    notes: dict[str, tuple[str, ...]]
    failures: dict[str, str]

    @property
    def reflected(self) -> tuple[bool, ...]:
        """Whether each specimen is a mirror image of the template's kind, as far as it can be told."""
        return tuple(side == "mirrored" for side in self.sides)

    @property
    def unreflected(self) -> Float[np.ndarray, "s n 3"]:
        """The points, of reflected specimens mirrored back: shapes that motions can compare."""
        return unreflect(self.points, self.reflected)

    def read_specimen(self, name: str) -> TriangleMesh:
        """Read the surface of a specimen, facing outward.

        Parameters
        ----------
        name : str
            One of `names`.

        Raises
        ------
        InvalidParameterError
            If no specimen has this name.
        FileFormatError, InvalidShapeError, OSError
            As `es.io.read_surface`, if the file has changed.
        """
        return read_specimen(self.sources[self.number(name)])[0]

    def number(self, name: str) -> int:
        """Return the row of a specimen.

        Parameters
        ----------
        name : str
            One of `names`.

        Raises
        ------
        InvalidParameterError
            If no specimen has this name.
        """
        if name not in self.names:
            reason = f" It failed: {self.failures[name]}" if name in self.failures else ""
            raise InvalidParameterError(
                f"The name must be that of a specimen of the collection; {name!r} is not.{reason}"
            )
        return self.names.index(name)


def open_collection(folder: str | Path) -> Collection:
    """Open a collection that `build_collection` has made in a folder.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    Collection

    Raises
    ------
    StoreError
        If there is no finished collection, a file of it is damaged, or another version wrote it.

    See Also
    --------
    build_collection

    Examples
    --------
    >>> import eigenshape as es
    >>> es.collections.open_collection("no-such-folder")
    Traceback (most recent call last):
    ...
    eigenshape...StoreError: A finished collection must be in the folder; ...
    """
    folder = as_path(folder)
    try:
        table = json.loads((folder / TABLE).read_bytes())
        version, rows = table["version"], table["specimens"]
        fits = [read_fit(fit_file(folder, row["name"])) for row in rows]
        mean = read_mesh(folder / MEAN)
    except FileNotFoundError as err:
        raise StoreError(
            f"A finished collection must be in the folder; {err.filename} is not there. Build it "
            "again with the same folder: what is done is kept."
        ) from err
    except (ValueError, KeyError, TypeError) as err:
        raise StoreError(
            f"The files of a collection must be whole; one in {folder} is not: {err}. Build it "
            "again with the same folder."
        ) from err
    if version != VERSION:
        raise StoreError(
            f"The version of a collection must be {VERSION}; that in {folder} has {version}."
        )
    return Collection(
        folder=folder,
        names=tuple(row["name"] for row in rows),
        mean=mean,
        points=np.stack([fit["vertices"] for fit in fits]),
        gaps=np.stack([fit["gaps"] for fit in fits]),
        confidence=np.stack([fit["confidence"] for fit in fits]),
        sides=tuple(row["side"] for row in rows),
        methods=tuple(row["method"] for row in rows),
        sources=tuple(Path(row["source"]) for row in rows),
        template=table["template"],
        notes={row["name"]: tuple(row["notes"]) for row in rows},
        failures=table["failures"],
    )


def save_collection(collection: Collection) -> None:
    """Write all but the fits, which are there already; collection.json comes last."""
    write_mesh(collection.mean, collection.folder / MEAN)
    rows: list[dict[str, Any]] = [
        {
            "name": name,
            "source": str(source),
            "side": side,
            "method": method,
            "size": float(np.linalg.norm(points - points.mean(axis=0))),
            "notes": collection.notes[name],
        }
        for name, source, side, method, points in zip(
            collection.names,
            collection.sources,
            collection.sides,
            collection.methods,
            collection.points,
            strict=True,
        )
    ]
    header = ["specimen", "side", "method", "size", "notes"]
    lines = [
        [row["name"], row["side"], row["method"], row["size"], "; ".join(row["notes"])]
        for row in rows
    ]
    lines += [[name, "", "failed", "", reason] for name, reason in collection.failures.items()]
    replace_file(collection.folder / SPECIMENS, csv_text([header, *lines]).encode())
    table = {
        "version": VERSION,
        "template": collection.template,
        "specimens": rows,
        "failures": collection.failures,
    }
    replace_file(collection.folder / TABLE, json.dumps(table, indent=1).encode())


def fit_file(folder: Path, name: str, room: str = "fits") -> Path:
    """Return the file of a specimen's fit; names may hold what names of files must not."""
    return folder / room / f"{quote(name, safe=' ')}.npz"


def write_fit(path: Path, **arrays: Any) -> None:
    """Write the arrays of a fit, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as file:
        np.savez(file, **arrays)


def read_fit(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of a fit; raise ValueError if the file is damaged."""
    try:
        with np.load(path) as arrays:
            return dict(arrays)
    except (BadZipFile, EOFError) as err:
        raise ValueError(f"{path}: {err}") from err


def read_specimen(path: Path) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Read a surface, turn it to face outward, since pairs need normals that agree, and report that."""
    read = read_surface(path)
    mesh, report = read.mesh, read.report
    try:
        turned = orient_outward(mesh)
    except InvalidShapeError:  # neighbors that disagree
        done = repair(mesh, ["auto"])
        mesh, report = done.mesh, (*report, *done.report)
        inward = outward_vote(main_pieces(mesh)) < 0
        turned = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]) if inward else mesh
    if turned is not mesh:
        report = (*report, "all faces were turned over, to look outward")
    return turned, report


def unreflect(
    points: Float[np.ndarray, "s n 3"], reflected: tuple[bool, ...]
) -> Float[np.ndarray, "s n 3"]:
    """Mirror the points of reflected specimens."""
    flips = np.where(np.array(reflected)[:, None, None], MIRROR, np.eye(3))
    return points @ flips
