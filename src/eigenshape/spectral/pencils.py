"""The pencil of a Laplacian, with what messages of the solver say about shapes."""

from certeig.advice import Advice
from certeig.solver.pencil import Pencil
from eigenshape.operators.laplacian import Laplacian

LARGEST = 'repair(mesh, ["auto", "largest_component"]), or --repair auto,largest_component on the command line'
ADVICE = Advice(
    stiffness="stiffness",
    mass="mass",
    row="point",
    unit="1/length²",
    scales=(
        'Try repair(mesh, ["auto"]) or robust_laplacian(mesh); on the command line, --repair auto or '
        "--operator robust."
    ),
    separate=f"The smallest and the largest elements are in separate pieces. Try {LARGEST}.",
    pieces=(
        "The shape is in {n} pieces, each of which has a lowest eigenvalue. Try "
        f"{LARGEST}: it joins pieces that lie edge on edge, and drops others."
    ),
    memory=(
        "Request fewer pairs, or pass method='approximate' to solve_spectrum, which needs no factor."
    ),
    rounding="Repair nearly degenerate elements.",
    inaccurate="Nearly degenerate elements do this.",
    slow="Repair nearly degenerate elements, or request fewer pairs.",
)


def normalize(laplacian: Laplacian) -> Pencil:
    """Scale the matrices of an operator by powers of two, and find a lower bound of B.

    Raises an InvalidParameterError if B is not positive definite, or entries on a diagonal lie too
    far apart for floats.
    """
    kernel = laplacian.kernel
    return Pencil.scaled(
        laplacian.stiffness,
        laplacian.mass,
        known_floor=laplacian.mass_floor,
        saturation=0.0 if kernel is None else kernel.edge_factor**2,
        advice=ADVICE,
    )
