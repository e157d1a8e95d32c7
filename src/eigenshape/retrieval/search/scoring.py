"""Exact scores of candidates, and the matches of the best."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.kinds import Descriptor, as_stored, row_type, score_rows, verify_scores
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.search.candidates import Candidates
from eigenshape.retrieval.search.chances import chances, nothing_alike
from eigenshape.retrieval.search.matches import Match, Matches
from eigenshape.retrieval.store.state import Snapshot
from eigenshape.retrieval.store.writing import require_columns, rows_of_each

BYTES_AT_ONCE = 2**27  # of rows in memory: 3,300 shapes with views


@one_blas_thread()
def search_candidates(
    snapshot: Snapshot,
    descriptor: Descriptor,
    candidates: Candidates,
    n_matches: int,
    isolations: Float[np.ndarray, " n"],
) -> Matches:
    """Find the shapes with the lowest scores among the candidates of a query.

    Checksums are verified of the shapes that are returned, and of those whose points are matched.

    Raise DamagedEntryError if shapes are damaged: leave them out, and search again.

    Parameters
    ----------
    snapshot : Snapshot
        Of n places.
    descriptor : HeatDescriptor or PatchDescriptor
    candidates : Candidates
    n_matches : int
    isolations : (n,) float
        By which scores are scaled.

    Returns
    -------
    Matches
        Lowest score first, each shape once; equal scores are sorted by name.
    """
    columns = snapshot.columns
    (rows,) = rows_of_each("the query", [descriptor])
    query = as_stored(descriptor)
    require_columns(descriptor.recipe, rows.shape[1], int(columns["n_columns"][0]))
    places = candidates.places
    if not len(places):
        return Matches((), candidates.method, 0, candidates.n_shapes)
    # An exact search reads the whole index, which need not fit into memory.
    sizes = (
        columns["n_rows"][places]
        * columns["n_columns"][places]
        * row_type(descriptor.recipe).itemsize
    )
    parts = np.split(places, np.flatnonzero(np.diff(np.cumsum(sizes) // BYTES_AT_ONCE)) + 1)
    found = [score_rows(query, snapshot.rows_of(some), isolations[some]) for some in parts]
    distances = np.concatenate(found)
    # Only damaged rows have no finite distance; reading such a descriptor raises the error.
    for bad in places[~np.isfinite(distances)].tolist():
        snapshot.descriptor(bad)
    scores = verify_scores(
        query, lambda number: snapshot.descriptor(int(places[number])), distances
    )
    # Of the views of each shape, keep the one with the lowest score.
    order = np.argsort(scores, kind="stable")
    firsts = np.unique(snapshot.shape_of[places[order]], return_index=True)[1]
    order = order[np.sort(firsts)]
    if len(order) > n_matches:  # with all that score as the last one does, to be sorted by name
        order = order[scores[order] <= scores[order[n_matches - 1]]]
    known = zip(scores[order].tolist(), snapshot.facts(places[order]), order.tolist(), strict=True)
    best = sorted(known, key=lambda each: (each[0], each[1].name))[:n_matches]
    matches = []
    for score, facts, number in best:
        place = int(places[number])
        stored = snapshot.descriptor(place)
        view = int(columns["view"][place])
        match = Match(facts.name, facts.label, facts.source, score, query, stored, view)
        if isinstance(query, PatchDescriptor):
            chance = float(chances(score))
            match = replace(match, chance=chance, distance=float(distances[number]))
        matches.append(match)
    nothing = False
    if isinstance(descriptor, PatchDescriptor):
        nothing = nothing_alike(scores, candidates.n_shapes)
    return Matches(tuple(matches), candidates.method, len(places), candidates.n_shapes, nothing)
