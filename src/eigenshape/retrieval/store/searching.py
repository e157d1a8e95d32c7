"""Exact scores of candidates, and the matches of the best."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from eigenshape._threads import one_blas_thread
from eigenshape.retrieval.kinds import Descriptor, kind_of
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.isolation import USUAL_ISOLATION
from eigenshape.retrieval.search.candidates import Candidates
from eigenshape.retrieval.search.chances import chances, nothing_alike
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.records import Match, Matches
from eigenshape.retrieval.store.snapshot import DamagedEntryError, Snapshot
from eigenshape.retrieval.store.writing import require_columns, rows_of_each


@one_blas_thread()
def search_candidates(
    snapshot: Snapshot,
    descriptor: Descriptor,
    candidates: Candidates,
    n_matches: int,
    *,
    is_scaled: bool = True,
) -> tuple[Matches, list[Damage]]:
    """Find the shapes with the lowest scores among the candidates of a query.

    Checksums are verified of the shapes that are returned, and of those whose points are matched.
    A damaged shape is left out, and the search is made again. Unless the scores are scaled by how
    isolated each shape is, they depend on the two shapes alone.

    Returns
    -------
    matches : Matches
        Lowest score first, each shape once; equal scores are sorted by name.
    damages : list of Damage
    """
    kind = kind_of(descriptor.recipe)
    (rows,) = rows_of_each("the query", [descriptor])
    query = kind.as_stored(descriptor)
    require_columns(descriptor, rows, int(snapshot.columns["n_columns"][0]))
    places, damages = candidates.places, []
    found: tuple[Match, ...] = ()
    nothing = False
    while len(places):
        # An exact search reads all shapes one after the other in any case.
        stored = snapshot.rows_of(places, read_ahead=candidates.method != "exact")
        usual = np.full(len(places), USUAL_ISOLATION)
        isolations = snapshot.isolations[places] if is_scaled else usual
        distances = kind.scores(query, stored, isolations)
        try:
            for bad in places[~np.isfinite(distances)].tolist():
                snapshot.verify(bad)
            scores = kind.verify(query, _descriptor_of(snapshot, places), distances)
            found = _best(snapshot, query, places, distances, scores, n_matches)
        except DamagedEntryError as err:
            damages.append(err.damage)
            places = places[places != err.place]
        else:
            if isinstance(descriptor, PatchDescriptor):
                is_closed = len(descriptor.codes) > 1
                nothing = nothing_alike(scores, candidates.n_shapes, is_closed=is_closed)
            break
    n_shapes = candidates.n_shapes - len(damages)
    return Matches(found, candidates.method, len(places), n_shapes, nothing), damages


def _descriptor_of(snapshot: Snapshot, places: np.ndarray):  # type: ignore[no-untyped-def]
    return lambda number: snapshot.descriptor(int(places[number]))


def _best(
    snapshot: Snapshot,
    query: Descriptor,
    places: np.ndarray,
    distances: Float[np.ndarray, " k"],
    scores: Float[np.ndarray, " k"],
    n_matches: int,
) -> tuple[Match, ...]:
    # Of the views of each shape, keep the one with the lowest score.
    order = np.argsort(scores, kind="stable")
    firsts = np.unique(snapshot.shape_of[places[order]], return_index=True)[1]
    order = order[np.sort(firsts)]
    if len(order) > n_matches:  # with all that score as the last one does, to be sorted by name
        order = order[scores[order] <= scores[order[n_matches - 1]]]
    best = [(float(scores[number]), snapshot.name(int(places[number])), number) for number in order]
    best.sort()
    return tuple(
        _match(snapshot, query, int(places[number]), float(distances[number]), score)
        for score, _, number in best[:n_matches]
    )


def _match(
    snapshot: Snapshot, query: Descriptor, place: int, distance: float, score: float
) -> Match:
    shape, found = snapshot.shape(place), snapshot.descriptor(place)
    view = int(snapshot.columns["view"][place])
    match = Match(shape.name, shape.label, shape.source, score, query, found, view)
    if not isinstance(query, PatchDescriptor):
        return match
    return replace(match, chance=float(chances(np.array([score]))[0]), distance=distance)
