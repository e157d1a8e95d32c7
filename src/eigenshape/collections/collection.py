"""A collection of specimens in dense correspondence, and the folder that it is kept in."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path, content_digest, replace_file
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError, StoreError
from eigenshape.collections.alignment import MIRROR, Side, best_similarity
from eigenshape.collections.parts import SPECIMENS, read_state
from eigenshape.collections.spread_points import main_pieces
from eigenshape.collections.surface_fit import SurfaceFit
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward, outward_vote
from eigenshape.geometry.repairs.repair import repair
from eigenshape.io.mesh_files import write_mesh
from eigenshape.io.surface_files import read_surface
from eigenshape.morphometrics.landmark_files import csv_text

TABLE, MEAN = "specimens.csv", "mean.ply"


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
    digests : tuple of str
        SHA-256 of each file when it was fitted; empty if it is not known.

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
    digests: tuple[str, ...] = ()

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
        StoreError
            If the file has changed since it was fitted.
        FileFormatError, InvalidShapeError, OSError
            As `es.io.read_surface`, if it cannot be read.
        """
        row = self.number(name)
        source = self.sources[row]
        if self.digests and content_digest(source) != self.digests[row]:
            raise StoreError(
                f"The surface of a specimen must be the one that was fitted; {source}, of {name!r}, "
                "has changed. Build the collection again."
            )
        return read_specimen(source)[0]

    def read_placed(self, name: str, onto: ArrayLike) -> TriangleMesh:
        """Read the surface of a specimen, mirrored back if it is reflected, and placed by its points.

        Parameters
        ----------
        name : str
            One of `names`.
        onto : (n, 3) float
            Where its points are to lie, such as the vertices of `mean`, in length. A similarity
            brings them as near as it can.

        Raises
        ------
        InvalidParameterError
            If no specimen has this name.
        InvalidShapeError
            If `onto` is not one finite row for each point.
        StoreError, FileFormatError, OSError
            As `read_specimen`.
        """
        row, mesh = self.number(name), self.read_specimen(name)
        places = finite_rows(onto, "onto", 3)
        reflected = self.reflected[row : row + 1]
        own = unreflect(self.points[row : row + 1], reflected)[0]
        if len(places) != len(own):
            raise InvalidShapeError(
                f"onto must hold one row for each of {len(own)} points; it holds {len(places)}."
            )
        placing = best_similarity(own, places, np.ones(len(own)))
        vertices = placing.move(unreflect(mesh.vertices[None], reflected)[0])
        return TriangleMesh(vertices, mesh.faces[:, ::-1] if self.reflected[row] else mesh.faces)

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

    While it is built again, and after a build that was stopped, this is the last one that was
    finished.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    Collection

    Raises
    ------
    StoreError
        If there is no finished collection, its file is damaged, or another version wrote it.

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
    return collection_of(folder, *read_state(folder))


def collection_of(
    folder: Path, facts: dict[str, Any], mean: TriangleMesh, fits: Sequence[SurfaceFit]
) -> Collection:
    """Return the collection of a state, as `write_state` takes it."""
    rows = facts["specimens"]
    return Collection(
        folder=folder,
        names=tuple(row["name"] for row in rows),
        mean=mean,
        points=np.stack([fit.vertices for fit in fits]),
        gaps=np.stack([fit.gaps for fit in fits]),
        confidence=np.stack([fit.confidence for fit in fits]),
        sides=tuple(fit.side for fit in fits),
        methods=tuple(fit.method for fit in fits),
        sources=tuple(Path(row["source"]) for row in rows),
        digests=tuple(row["digest"] for row in rows),
        template=facts["template"],
        notes={row["name"]: tuple(row["notes"]) for row in rows},
        failures=facts["failures"],
    )


def export_collection(collection: Collection) -> None:
    """Write the mean and a table of the specimens for others, and delete what they do not need."""
    rows: list[list[object]] = [["specimen", "side", "method", "size", "notes"]]
    columns = (collection.names, collection.sides, collection.methods, collection.points)
    for name, side, method, points in zip(*columns, strict=True):
        size = float(np.linalg.norm(points - points.mean(axis=0)))
        rows.append([name, side, method, size, "; ".join(collection.notes[name])])
    rows += [[name, "", "failed", "", reason] for name, reason in collection.failures.items()]
    replace_file(collection.folder / TABLE, csv_text(rows).encode())
    write_mesh(collection.mean, collection.folder / MEAN)
    for path in (collection.folder / SPECIMENS).glob("*"):
        if path.absolute() not in collection.sources:
            path.unlink()


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
