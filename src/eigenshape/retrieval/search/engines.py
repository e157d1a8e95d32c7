"""Candidates from vector engines: FAISS in memory, and Qdrant as an existing database.

An engine knows vectors and inner products. It supplies candidates alone: these are scored as a
scan would score them, and the best are compared exactly.
"""

from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Int, Int8

from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr
from eigenshape._extras import import_extra
from eigenshape.retrieval.search.candidates import Supplier, smallest
from eigenshape.retrieval.search.coarse import CoarseRows

VECTORS_AT_ONCE = 30_000  # given to an engine at a time: 46 MB as floats
# Of FAISS: 4-bit product quantization of six numbers each, and lists of vectors that lie together.
# With 64 of them read, benchmarks/bench_search.py finds what a scan finds.
CODE = "PQ64x4fs"
VECTORS_OF_LIST = 300  # on average
LISTS_READ = 64  # of the lists nearest to a query
TRAINING_VECTORS_OF_LIST = 40  # fewer than 39 make FAISS warn
# Vectors that are asked for, in place of one for each candidate: a shape has three of them, and
# coarse codes order them roughly.
VECTORS_ASKED_FOR = 2


@runtime_checkable
class Engine(Protocol):
    """Vectors that are searched by inner products.

    Number k × s + i is size i of row k of ``CoarseRows.numbers``.
    """

    def nearest(self, queries: Float32[np.ndarray, "p q"], count: int) -> Int[np.ndarray, "p c"]:
        """Return the numbers of the vectors with the largest products, best first; -1 for none."""


def supply_from(engine: Engine, coarse: CoarseRows) -> Supplier:
    """Return what supplies candidates from an engine that holds `coarse_vectors`.

    Sizes are compared as the scan does it: the least size of the query with all of a shape, and
    the others with the least size of a shape. Shapes that were added since the file of short rows
    was written are candidates in any case.
    """
    n_rows, n_sizes, _ = coarse.numbers.shape

    def supplied(codes: Int8[np.ndarray, "b s v"], count: int) -> Int[np.ndarray, " k"]:
        queries = coarse.axes.project_query(codes)
        found = np.asarray(engine.nearest(queries, VECTORS_ASKED_FOR * count))
        if found.dtype.kind not in "iu" or found.ndim != 2 or len(found) != len(queries):
            raise InvalidParameterError(
                f"nearest of an engine must return integers of shape ({len(queries)}, c); they are of "
                f"{found.dtype} and shape {found.shape}."
            )
        if found.size and found.max() >= n_rows * n_sizes:
            raise InvalidParameterError(
                f"nearest of an engine must return numbers of vectors, below {n_rows * n_sizes}; one is "
                f"{found.max()}."
            )
        numbers = np.concatenate([found[0], found[1:][found[1:] % n_sizes == 0]])
        chosen = np.zeros(len(coarse.checksums), dtype=bool)
        chosen[numbers[numbers >= 0] // n_sizes] = True
        chosen[n_rows:] = True
        places = np.flatnonzero(chosen[coarse.rows])
        return places[smallest(coarse.scores_at(codes, places), count)]

    return supplied


def coarse_vectors(coarse: CoarseRows, first: int, last: int) -> Float32[np.ndarray, "c q"]:
    """Return vectors of the rows from `first` to `last`, each size one, as an engine holds them."""
    steps = coarse.axes.steps.reshape(-1)
    return (coarse.numbers[first:last] * steps).reshape(-1, len(steps))


class FaissEngine:
    """An index of FAISS in memory: inverted lists with product quantization.

    Parameters
    ----------
    coarse : CoarseRows
        Of all shapes.

    Raises
    ------
    MissingExtraError
        If FAISS is not installed.

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.open("my-index")  # doctest: +SKIP
    >>> with index.reader(es.retrieval.FaissEngine) as reader:  # doctest: +SKIP
    ...     matches = reader.query(es.read_mesh("scan.ply"))
    """

    _repr_html_ = html_repr

    def __init__(self, coarse: CoarseRows) -> None:
        faiss = import_extra("faiss", "'eigenshape[faiss]'")
        n_shapes, n_sizes, width = coarse.numbers.shape
        n_lists = max(n_shapes * n_sizes // VECTORS_OF_LIST, 1)
        index: Any = faiss.index_factory(width, f"IVF{n_lists},{CODE}", faiss.METRIC_INNER_PRODUCT)
        most = max(n_lists * TRAINING_VECTORS_OF_LIST, 1000)
        spread = np.unique(np.linspace(0, n_shapes - 1, min(most // n_sizes + 1, n_shapes)))
        index.train(
            np.concatenate([coarse_vectors(coarse, k, k + 1) for k in spread.astype(int).tolist()])
        )
        for first in range(0, n_shapes, VECTORS_AT_ONCE // n_sizes):
            index.add(coarse_vectors(coarse, first, first + VECTORS_AT_ONCE // n_sizes))
        index.nprobe = min(LISTS_READ, n_lists)
        self._index = index

    def __repr__(self) -> str:
        return f"FaissEngine({self._index.ntotal} vectors)"

    def nearest(self, queries: Float32[np.ndarray, "p q"], count: int) -> Int[np.ndarray, "p c"]:
        """Return the numbers of the vectors with the largest products.

        Parameters
        ----------
        queries : (p, q) float32
            One vector in each row.
        count : int
            How many numbers to return for each query; -1 fills up what is missing.
        """
        _, numbers = self._index.search(np.ascontiguousarray(queries), count)
        return np.asarray(numbers)


class QdrantEngine:
    """A collection of a Qdrant database, as a server or embedded.

    Parameters
    ----------
    client : qdrant_client.QdrantClient
    collection : str
        Its name. `fill` makes it.

    Examples
    --------
    >>> import eigenshape as es
    >>> from qdrant_client import QdrantClient  # doctest: +SKIP
    >>> engine = es.retrieval.QdrantEngine(QdrantClient(":memory:"), "shapes")  # doctest: +SKIP
    """

    _repr_html_ = html_repr

    def __init__(self, client: Any, collection: str) -> None:
        self.client, self.collection = client, collection

    def __repr__(self) -> str:
        return f"QdrantEngine({self.collection!r})"

    def fill(self, coarse: CoarseRows) -> None:
        """Make the collection anew, and add the vectors of all shapes.

        Parameters
        ----------
        coarse : CoarseRows
            Of all shapes.

        Raises
        ------
        MissingExtraError
            If the client of Qdrant is not installed.
        """
        models = import_extra("qdrant_client", "'eigenshape[qdrant]'").models
        n_shapes, n_sizes, width = coarse.numbers.shape
        if self.client.collection_exists(self.collection):
            self.client.delete_collection(self.collection)
        self.client.create_collection(
            self.collection,
            vectors_config=models.VectorParams(size=width, distance=models.Distance.DOT),
        )
        for first in range(0, n_shapes, VECTORS_AT_ONCE // n_sizes):
            vectors = coarse_vectors(coarse, first, first + VECTORS_AT_ONCE // n_sizes)
            self.client.upload_collection(
                self.collection,
                vectors,
                ids=range(first * n_sizes, first * n_sizes + len(vectors)),
            )

    def nearest(self, queries: Float32[np.ndarray, "p q"], count: int) -> Int[np.ndarray, "p c"]:
        """Return the numbers of the vectors with the largest products.

        Parameters
        ----------
        queries : (p, q) float32
            One vector in each row.
        count : int
            How many numbers to return for each query; -1 fills up what is missing.
        """
        found = np.full((len(queries), count), -1, dtype=np.int64)
        for row, query in zip(found, queries, strict=True):
            answer = self.client.query_points(
                self.collection, query=query.tolist(), limit=count, with_payload=False
            )
            row[: len(answer.points)] = [point.id for point in answer.points]
        return found
