"""Pairs of shapes of an index that are nearly the same."""

from dataclasses import replace

import numpy as np

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.search.matches import Match
from eigenshape.retrieval.search.options import QueryOptions

# Of five kinds of synthetic creatures and eight real shapes, with six views each: moved and scaled,
# or with another order of vertices, a shape has a score up to 0.053; with noise of a thousandth of
# its size, up to 0.031, and of three thousandths (creatures), 0.04 to 0.1. Other poses of creatures,
# a horse and a cat have 0.01 to 0.19, other meshes of creatures, of half or twice as many vertices,
# 0.1 to 0.5. Real shapes of one class (teddies, cups, hands) have 0.08 and more, other real classes
# 0.33 and more, other kinds of creatures 0.47 and more.
NEARLY_THE_SAME = 0.1
# Of 19 shapes, moved and scaled in single precision, copies have a score up to 0.009, and poses of
# animals 0.01 and more.
COPY = 0.01
AT_FIRST = 16  # matches of a shape that are looked at; more only where all are near


def find_duplicates(
    index: ShapeIndex, *, most_score: float = NEARLY_THE_SAME, progress: Progress | None = None
) -> list[tuple[str, str, float, str]]:
    """Find pairs of shapes that are nearly the same, wherever they lie and whatever their size.

    Each shape is searched for in the index, as it is stored. Unlike those of `ShapeIndex.query`,
    scores are not corrected for hubness, so they depend on the two shapes alone.

    Parameters
    ----------
    index : ShapeIndex
    most_score : float
        Scores up to which two shapes count as nearly the same. A copy has the score 0, also a
        reflected one; if it is moved or scaled, mostly less than 0.01, and with other vertices less
        than 0.06. A shape in another pose often has 0.01 to 0.1; for heat, scores have other sizes.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    list of (str, str, float, str)
        Two names in alphabetical order, the lower score of the two searches, and what the shapes are
        to each other; lowest score first. "copy" and "mirror image" have a score below 0.01, and are
        told apart by `Match.mirrored`; "similar" is another pose, noise, or a copy with other
        vertices.

    Raises
    ------
    InvalidParameterError
        If `most_score` is negative or not finite.
    StoreError
        If the index cannot be read.

    See Also
    --------
    ShapeIndex.query, ShapeIndex.remove

    Examples
    --------
    >>> import eigenshape as es
    >>> index, fish = es.ShapeIndex.create(None), es.make_creature("fish", n_vertices=500)
    >>> large = es.TriangleMesh(9 * fish.vertices, fish.faces)
    >>> for name, mesh in {"fish": fish, "large fish": large}.items():
    ...     index.add(name, mesh, n_views=0)
    >>> for one, two, score, kind in es.retrieval.find_duplicates(index):
    ...     print(f"{one}, {two}: {kind}")
    fish, large fish: copy
    """
    require_type(index, ShapeIndex, "index")
    if not 0 <= most_score < np.inf:
        raise InvalidParameterError(
            f"most_score must be finite and at least 0; it is {most_score}."
        )
    pairs: dict[tuple[str, str], tuple[float, str]] = {}
    if not len(index):
        return []
    with index.reader() as reader:
        snapshot = reader.snapshot(reader.default_recipe())
        # The first descriptor of each shape is that of the whole.
        places = np.flatnonzero(snapshot.columns["view"] == 0)
        for number, (place, facts) in enumerate(zip(places, snapshot.facts(places), strict=True)):
            name = facts.name
            if progress is not None:
                progress(number / len(places), name)
            descriptor = snapshot.descriptor(int(place))
            # Scaled, shapes would be less alike where others are like them.
            options = QueryOptions(AT_FIRST, without=name, is_scaled=False)
            found = reader.ask(descriptor, options)
            while len(found) == options.n_matches and found[-1].score <= most_score:
                options = replace(options, n_matches=4 * len(found))
                found = reader.ask(descriptor, options)
            for match in found:
                pair = min(name, match.name), max(name, match.name)
                if match.score <= most_score and (
                    pair not in pairs or match.score < pairs[pair][0]
                ):
                    pairs[pair] = match.score, _kind(match)
    return sorted(((*pair, *found) for pair, found in pairs.items()), key=lambda row: (row[2], row))


def _kind(match: Match) -> str:
    """Return what two shapes that are nearly the same are to each other."""
    if match.score >= COPY:
        return "similar"
    return "mirror image" if match.mirrored else "copy"
