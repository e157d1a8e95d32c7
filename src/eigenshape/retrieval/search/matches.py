"""What a query finds in an index."""

from collections.abc import Sequence
from functools import cached_property
from typing import overload

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown, html_repr
from certeig.kit.threads import one_blas_thread
from eigenshape.retrieval.kinds import Descriptor, pair_points
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.search.candidates import Method
from eigenshape.retrieval.search.chances import class_chances


@record
class Match(ReadOnly):
    """A shape that `ShapeIndex.query` found.

    Attributes
    ----------
    name, label, source : str
        As in its `Record`.
    score : float
        Of `matching_score` or `patch_scores`: 0, or nearly, for the same descriptor; smaller is
        more alike.
    query, descriptor : HeatDescriptor or PatchDescriptor
        That was searched for, as the index keeps numbers; and that of this shape.
    view : int
        Which of the descriptors of the shape matched, in the order in which they were added: 0 is
        the first, that of the whole shape.
    chance : float or None
        Share of unrelated shapes that would score as well or better: below 0.001 the match is
        hardly a coincidence. Measured for patches; None for heat.
    distance : float or None
        Of codes of patches, before points were matched: the score if none agree. It is scaled by
        how isolated the shape is, the mean distance to its five nearest in the index: a shape that
        is near to many others is near to any query. None for heat.

    See Also
    --------
    ShapeIndex.query, Matches

    Examples
    --------
    >>> import tempfile
    >>> import eigenshape as es
    >>> recipe = es.retrieval.SCALE_FREE
    >>> index = es.ShapeIndex.create(tempfile.mkdtemp())
    >>> for name in ("fish", "biped"):
    ...     mesh = es.make_creature(name, n_vertices=500)
    ...     index.add(name, mesh, label="creature", recipe=recipe, n_views=0)
    >>> scan = es.make_creature("fish", pose=1, n_vertices=500)
    >>> match = index.query(es.describe(scan, recipe), n_matches=1)[0]
    >>> match.name, match.label, len(match.vertices)
    ('fish', 'creature', 15)
    """

    name: str
    label: str | None
    source: str | None
    score: float
    query: Descriptor
    descriptor: Descriptor
    view: int
    chance: float | None = None
    distance: float | None = None

    _repr_html_ = html_repr

    @property
    def vertices(self) -> Int[np.ndarray, " m"]:
        """Return the vertex of each feature or patch of this shape."""
        return self.descriptor.vertices

    @cached_property
    @one_blas_thread()
    def correspondences(self) -> Int[np.ndarray, "p 2"]:
        """Return the features or patches that correspond, surest pairs first.

        Each row is the number of one of the query, and of one of this shape. They are computed when
        they are first asked for, which takes 2 ms, and kept.
        """
        return freeze(pair_points(self.query, self.descriptor))

    @cached_property
    def mirrored(self) -> bool | None:
        """Say whether the query is rather like the mirror image of this shape, as a left bone of a right one.

        None if it cannot be told, since both sides are alike, as of an animal, since the shapes agree too
        little, or since both were described by heat. It takes 50 ms when it is first asked for.
        """
        if isinstance(self.query, PatchDescriptor) and isinstance(self.descriptor, PatchDescriptor):
            return self.query.is_mirror_image(self.descriptor)
        return None


@record
class Matches(Shown, Sequence[Match]):
    """What `ShapeIndex.query` found: a sequence of matches, best first, and how they were found.

    Attributes
    ----------
    found : tuple of Match
    method : str
        "exact" if all shapes were compared with the query, "staged" if the best after a coarse scan
        of all were, "candidates" if an engine chose those that were.
    n_compared, n_shapes : int
        Shapes that were compared exactly, and shapes among which they were found.
    nothing_alike : bool
        Whether the best score is no better than those of unrelated shapes, so that the index
        probably holds nothing like the query. Always False for heat, for which it was not measured.

    See Also
    --------
    ShapeIndex.query, query_indexes

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(None)
    >>> for kind in ("fish", "bird"):
    ...     index.add(kind, es.make_creature(kind, n_vertices=500), n_views=0)
    >>> matches = index.query(es.make_creature("fish", n_vertices=500))
    >>> len(matches), matches[0].name, matches.method, matches.nothing_alike
    (2, 'fish', 'exact', False)
    """

    found: tuple[Match, ...]
    method: Method
    n_compared: int
    n_shapes: int
    nothing_alike: bool = False

    def __len__(self) -> int:
        return len(self.found)

    @overload
    def __getitem__(self, number: int) -> Match: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Match, ...]: ...
    def __getitem__(self, number: int | slice) -> Match | tuple[Match, ...]:
        return self.found[number]

    def classify(self) -> dict[str, float]:
        """Return the probability of each class, by the labels of the first five matches.

        Ask for at least five. The probabilities hold if the class of the query is in the index,
        which `nothing_alike` doubts; what they lack to 1 is that of classes that were not found.

        Returns
        -------
        dict
            From label to probability, most probable first; empty if no match has a label.

        Raises
        ------
        InvalidParameterError
            If the matches are by heat, for which probabilities were not measured.

        Examples
        --------
        >>> import eigenshape as es
        >>> index = es.ShapeIndex.create(None)
        >>> for kind in ("fish", "bird"):
        ...     index.add(kind, es.make_creature(kind, n_vertices=500), label=kind, n_views=0)
        >>> classes = index.query(es.make_creature("fish", 1, n_vertices=500)).classify()
        >>> next(iter(classes)), classes["fish"] > 0.9
        ('fish', True)
        """
        for match in self.found:
            if match.chance is None:
                raise InvalidParameterError(
                    f"Probabilities of classes are known for patches; {match.name!r} was found by "
                    "heat. Ask by a PatchRecipe (--method patches), by which the index must describe "
                    "its shapes."
                )
        scores = [match.score for match in self.found]
        return class_chances(scores, [match.label for match in self.found])
