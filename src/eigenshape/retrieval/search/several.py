"""One answer from several indexes: parts of a collection that is too large for one machine."""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import lru_cache, partial
from os import PathLike
from pathlib import Path
from typing import Any

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.files import as_path
from certeig.kit.typing import Integer
from eigenshape._typing import IndexLike
from eigenshape.geometry.conversion import MeshLike
from eigenshape.retrieval.kinds import Descriptor, describe_query
from eigenshape.retrieval.patches.verification import N_VERIFIED
from eigenshape.retrieval.search.chances import chances
from eigenshape.retrieval.search.matches import Matches
from eigenshape.retrieval.search.options import MOST_MATCHES, QueryOptions
from eigenshape.retrieval.search.reader import IndexReader
from eigenshape.retrieval.store.database import DATABASE

MOST_OPEN = 256  # readers that a process keeps open between queries


def query_indexes(
    shape: MeshLike | Descriptor,
    folders: Sequence[IndexLike] | IndexLike,
    *,
    n_matches: Integer = 5,
    where: Mapping[str, Any] | None = None,
    exact: bool = False,
    executor: Executor | None = None,
) -> Matches:
    """Ask several indexes, and return nearly what one index of all their shapes would have answered.

    Each index corrects scores for hubness among its own shapes (`Match.distance`), which
    one index of them all would do among all.

    The workers of an executor each ask some of the indexes: processes of this machine, or a
    cluster's, where every worker sees the same folders. Indexes stay open in a process from one
    query to the next.

    Parameters
    ----------
    shape : MeshLike, HeatDescriptor or PatchDescriptor
        As of `ShapeIndex.query`. A mesh is described once, by the recipe of the first index.
    folders : sequence of path or ShapeIndex
        Different indexes with the same recipe, as from ``eigenshape index add --part``.
    n_matches : int
        Matches to return.
    where : mapping, optional
        As of `ShapeIndex.query`.
    exact : bool
        Whether to compare every shape.
    executor : concurrent.futures.Executor, optional
        By default one index is asked after the other.

    Returns
    -------
    Matches
        Best first. `nothing_alike` if it is true of each answer.

    Raises
    ------
    InvalidShapeError, InvalidParameterError, StoreError
        As `ShapeIndex.query`.

    See Also
    --------
    ShapeIndex.query, ShapeIndex.merge

    Examples
    --------
    >>> import tempfile
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> import eigenshape as es
    >>> folders = [tempfile.mkdtemp() for _ in range(2)]
    >>> for kind, folder in zip(("fish", "bird"), folders):
    ...     index = es.ShapeIndex.create(folder)
    ...     index.add(kind, es.make_creature(kind, n_vertices=500), n_views=0)
    >>> scan = es.make_creature("fish", pose=1, n_vertices=500)
    >>> with ThreadPoolExecutor() as executor:
    ...     matches = es.retrieval.query_indexes(scan, folders, executor=executor)
    >>> [match.name for match in matches]
    ['fish', 'bird']
    """
    require_type(executor, Executor | None, "executor")
    # One of several indexes need not have each attribute.
    options = QueryOptions(n_matches, where, exact=exact, must_know=False)
    if not isinstance(folders, Iterable) or isinstance(folders, str | PathLike):
        raise InvalidParameterError(
            f"folders takes a list of indexes; it was given one: {str(folders)!r}. Put it into a list."
        )
    named = [getattr(folder, "folder", folder) for folder in folders]
    paths = [as_path(folder, f"folders[{number}]").resolve() for number, folder in enumerate(named)]
    if not paths:
        raise InvalidParameterError("folders must name at least one index; it is empty.")
    for number, path in enumerate(paths):
        if path in paths[:number]:
            raise InvalidParameterError(
                f"folders must differ, or each match would come twice; folders[{number}] is {path}, "
                f"as folders[{paths.index(path)}] is. Leave it out."
            )
    descriptor = describe_query(shape, _open_reader(paths[0]).default_recipe())
    wanted = int(n_matches)
    more = replace(options, n_matches=min(wanted + N_VERIFIED, MOST_MATCHES))
    ask = partial(_ask, descriptor=descriptor, options=more)
    answers = list(map(ask, paths) if executor is None else executor.map(ask, paths))
    # Each index has matched the points of its own thirty nearest shapes. Here those count that are
    # among the thirty nearest of all, as they would in one index; the others keep the distance of
    # their codes.
    found = sorted(
        (match for answer in answers for match in answer),
        key=lambda match: match.score if match.distance is None else match.distance,
    )
    for place, match in enumerate(found[N_VERIFIED:], N_VERIFIED):
        if match.distance is not None:
            chance = float(chances(match.distance))
            found[place] = replace(match, score=match.distance, chance=chance)
    found.sort(key=lambda match: (match.score, match.name))
    return Matches(
        tuple(found[:wanted]),
        next((each.method for each in answers if each.method != "exact"), "exact"),
        sum(answer.n_compared for answer in answers),
        sum(answer.n_shapes for answer in answers),
        all(answer.nothing_alike for answer in answers),
    )


def _ask(folder: Path, *, descriptor: Descriptor, options: QueryOptions) -> Matches:
    reader = _open_reader(folder)
    reader.refresh()
    return reader.ask(descriptor, options)


def _open_reader(folder: Path) -> IndexReader:
    """Return a reader that was kept, unless the index was deleted and another one made there."""
    database = folder / DATABASE
    return _reader(folder, database.stat().st_ino if database.exists() else 0)


@lru_cache(maxsize=MOST_OPEN)
def _reader(folder: Path, inode: int) -> IndexReader:
    return IndexReader(folder)
