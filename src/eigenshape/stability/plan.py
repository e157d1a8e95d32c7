"""Options of a comparison. The command line reads its defaults for its help, so this module is light."""

from dataclasses import dataclass

from certeig.kit.text import html_repr

# Eigenvalues to compare by default.
USUAL_K = 20


@dataclass(frozen=True)
class StabilityPlan:
    """Options of `compare_shapes`.

    Parameters
    ----------
    k : int, optional
        Number of eigenvalues to compare; by default 20, or fewer if the smaller shape has fewer.
    n_samples : int
        Number of random points of each shape, 100 to 20,000; of a cloud at most half of its points.
    times : sequence of float, optional
        Heat times in length²; by default four over the admissible range.
    seed : int
        Seed of the random points.
    brackets : bool
        Whether to compute guaranteed bounds of each eigenvalue of both meshes, which prove changes
        for the shapes themselves.

    See Also
    --------
    compare_shapes : Compare two shapes.

    Examples
    --------
    >>> import eigenshape as es
    >>> plan = es.stability.StabilityPlan(k=8, n_samples=500)
    """

    k: int | None = None
    n_samples: int = 2000
    times: tuple[float, ...] = ()
    seed: int = 0
    brackets: bool = False

    _repr_html_ = html_repr
