"""Certified eigenpairs in torch, and their gradients by implicit differentiation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import silent
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import Integer
from certeig.solver.certified import certified_pairs
from eigenshape.operators.laplacian import Laplacian
from eigenshape.spectral.certificate import Certificate
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import spectrum_of
from eigenshape.torch.adjoint import SolvedPencil, find_groups, pull_back
from eigenshape.torch.operators import as_faces, as_tensor, cotangent_entries, to_numpy

# Pairs that are solved beyond k. They show whether the last group is complete, and with them taken
# out, the equations of the gradient need few iterations: without, those of the last pairs need tens.
SPARE_PAIRS = 16
# Points up to which all pairs are solved: the solver is dense there, and no equations are left.
ALL_PAIRS = 300


@dataclass(frozen=True, eq=False)
class TensorSpectrum:
    """Eigenpairs W φ = λ B φ as tensors with gradients.

    Eigenvalues that are closer than 1e-6 of the largest one form a group. Gradients of what depends
    on a group through its sum of eigenvalues and its projector Σ φ φᵀ are exact. The vectors of a
    group one by one have no derivative: a backward pass that asks for it raises an error.

    Attributes
    ----------
    eigenvalues : (k,) tensor
        λ ≥ 0 in ascending order, in 1/length².
    eigenvectors : (n, k) tensor
        Φ with ΦᵀBΦ = I, and the signs of `es.Spectrum`.
    levels : (k, k) tensor
        ΦᵀWΦ, the diagonal matrix of the eigenvalues. Unlike them its gradient says how a
        perturbation splits a group, which functions such as Φ exp(-t ΦᵀWΦ) Φᵀ need.
    mass : (n,) tensor or (n, n) sparse tensor
        B of the operator.
    groups : list of slice
        The groups, in ascending order.
    certificate : Certificate
        What is proved of the eigenvalues, with the spare pairs beyond k.
    """

    eigenvalues: Tensor
    eigenvectors: Tensor
    levels: Tensor
    mass: Tensor
    groups: list[slice]
    certificate: Certificate

    def __repr__(self) -> str:
        n, k = self.eigenvectors.shape
        return f"TensorSpectrum({k} eigenpairs in {len(self.groups)} groups on {n} points)"


def solve_spectrum(vertices: Any, faces: Any, k: Integer) -> TensorSpectrum:
    """Compute the k lowest eigenpairs of the cotangent operator, differentiable in the vertices.

    The pairs are those of `es.solve_spectrum`, certified and in double precision. Gradients follow
    by implicit differentiation (Magnus 1985): with W' and B' the derivatives of the matrices,

    λ' = φᵀ(W' - λB')φ,   (W - λB) φ' = -(W' - λB')φ + (φᵀ(W' - λB')φ) Bφ,   φᵀBφ' = -φᵀB'φ / 2.

    The second equation is solved by the known pairs and, beyond them, by conjugate gradients with
    factors of W - σB at shifts nearby, in the order of elimination that the solver found. Second
    derivatives of eigenvalues are exact, too.

    Parameters
    ----------
    vertices : (n, 3) float tensor
        Or any array that DLPack or NumPy takes. Computed in double precision.
    faces : (f, 3) int tensor
    k : int
        Number of eigenpairs, 1 to n.

    Returns
    -------
    TensorSpectrum

    Raises
    ------
    InvalidShapeError, InvalidParameterError, ConvergenceError
        As in `es.cotangent_laplacian` and `es.solve_spectrum`. By a backward pass:
        InvalidParameterError if it asks for derivatives of single vectors of a group, of a group
        that k cuts, or for second derivatives of eigenvectors.

    See Also
    --------
    solve_operator : The same for the values of W and B.

    Examples
    --------
    On the unit sphere, λ = 2 is a group of three. Enlarged by the factor s it is 2/s²:

    >>> import torch
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(3)
    >>> s = torch.tensor(1.0, requires_grad=True, dtype=torch.float64)
    >>> spectrum = et.solve_spectrum(s * torch.tensor(ball.vertices), ball.faces, 4)
    >>> spectrum.groups
    [slice(0, 1, None), slice(1, 4, None)]
    >>> spectrum.eigenvalues[1:].mean().backward()
    >>> round(s.grad.item(), 1)
    -4.0
    """
    points = as_tensor(vertices)
    places, values, mass = cotangent_entries(points, as_faces(faces))
    return _solve(places, values, mass, _diagonal_places(mass), mass, k)


def solve_operator(stiffness: Tensor, mass: Tensor, k: Integer) -> TensorSpectrum:
    """Compute the k lowest eigenpairs of an operator, differentiable in the values of W and B.

    Parameters
    ----------
    stiffness : (n, n) sparse COO tensor
        W, symmetric and positive semidefinite, as of a mesh or a graph.
    mass : (n,) tensor or (n, n) sparse COO tensor
        B, symmetric and positive definite, or its diagonal.
    k : int
        Number of eigenpairs, 1 to n.

    Returns
    -------
    TensorSpectrum

    Raises
    ------
    InvalidParameterError, ConvergenceError
        As in `es.solve_spectrum`, and as in `solve_spectrum` here by a backward pass.

    Examples
    --------
    A path of three points, and how its second eigenvalue depends on the weight of an edge:

    >>> import torch, eigenshape.torch as et
    >>> weight = torch.tensor(1.0, requires_grad=True, dtype=torch.float64)
    >>> zero, one = torch.zeros(()), torch.ones(())
    >>> W = torch.stack([weight, -weight, zero, -weight, weight + 1, -one, zero, -one, one])
    >>> spectrum = et.solve_operator(W.reshape(3, 3).to_sparse(), torch.ones(3), 3)
    >>> spectrum.eigenvalues.detach().numpy().round(9).tolist()
    [0.0, 1.0, 3.0]
    >>> spectrum.eigenvalues[1].backward()
    >>> round(weight.grad.item(), 6)
    0.5
    """
    W = _coalesced(stiffness, "stiffness")
    if isinstance(mass, Tensor) and mass.layout == torch.strided and mass.ndim == 1:
        diagonal = as_tensor(mass)
        given = W.indices(), W.values(), diagonal, _diagonal_places(diagonal)
        return _solve(*given, diagonal, k)
    B = _coalesced(mass, "mass")
    return _solve(W.indices(), W.values(), B.values(), B.indices(), B, k)


def _coalesced(matrix: Tensor, name: str) -> Tensor:
    if not isinstance(matrix, Tensor) or matrix.layout != torch.sparse_coo:
        raise InvalidParameterError(
            f"{name} must be a sparse COO tensor; it is {type(matrix).__name__} of layout "
            f"{getattr(matrix, 'layout', None)}. Call its method to_sparse() first."
        )
    if matrix.is_meta or matrix.is_complex():
        raise InvalidParameterError(
            f"{name} must hold real numbers; it is of {matrix.dtype} on {matrix.device}."
        )
    return matrix.to(torch.float64).coalesce()


def _diagonal_places(mass: Tensor) -> Tensor:
    return torch.arange(len(mass), device=mass.device).expand(2, -1)


def _solve(
    places: Tensor, values: Tensor, masses: Tensor, mass_places: Tensor, mass: Tensor, k: Integer
) -> TensorSpectrum:
    n = mass.shape[0]
    count = whole_number(k, "k", 1, n)
    W, B = (
        sp.csr_array((to_numpy(entries), tuple(to_numpy(where))), shape=(n, n))
        for entries, where in ((values, places), (masses, mass_places))
    )
    laplacian = Laplacian(W, B)
    solved_pairs = n if n <= ALL_PAIRS else min(count + SPARE_PAIRS, n)
    with one_blas_thread():
        pencil = normalize(laplacian)
        pairs, certificate = certified_pairs(pencil, solved_pairs, np.zeros(2), silent)
    spectrum = spectrum_of(laplacian, pencil, pairs, certificate)
    groups = find_groups(spectrum.eigenvalues)
    solved = SolvedPencil(
        laplacian, pencil, spectrum.eigenvalues, spectrum.eigenvectors, groups, count
    )
    shown, vectors, levels = _Pairs.apply(values, masses, places, mass_places, solved)
    kept = [slice(each.start, min(each.stop, count)) for each in groups if each.start < count]
    return TensorSpectrum(shown, vectors, levels, mass, kept, spectrum.certificate)


class _Pairs(torch.autograd.Function):  # type: ignore[misc]
    """Eigenvalues, eigenvectors and levels as a function of the values of W and B."""

    @staticmethod
    def forward(
        ctx: Any,
        values: Tensor,
        masses: Tensor,
        places: Tensor,
        mass_places: Tensor,
        solved: SolvedPencil,
    ) -> tuple[Tensor, Tensor, Tensor]:
        k = solved.n_shown
        eigenvalues = torch.tensor(solved.values[:k], device=values.device)
        eigenvectors = torch.tensor(solved.vectors[:, :k], device=values.device)
        levels = torch.diag(eigenvalues)
        ctx.solved = solved
        ctx.save_for_backward(eigenvectors, levels, places, mass_places)
        ctx.set_materialize_grads(False)
        return eigenvalues, eigenvectors, levels

    @staticmethod
    def backward(
        ctx: Any, by_value: Tensor | None, by_vector: Tensor | None, by_level: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        vectors, levels, places, mass_places = ctx.saved_tensors
        solved = ctx.solved
        # Only functions of a whole group have derivatives; what is asked of `levels` outside of
        # groups is that of constants 0.
        share = torch.zeros_like(levels)
        if by_value is not None:
            solved.require_sums(to_numpy(by_value))
            share = share + torch.diag(by_value)
        if by_level is not None:
            mask = torch.as_tensor(solved.same_group(), device=levels.device)
            share = share + torch.where(mask, (by_level + by_level.T) / 2, 0.0)
        solved.require_whole(to_numpy(share), None if by_vector is None else to_numpy(by_vector))
        # λ' = φᵀ(W' - λB')φ, for groups by ΦᵀWΦ in place of λ; in torch, for second derivatives.
        weighted = (share @ levels + levels @ share) / 2
        left, left_of_mass = vectors @ share, -vectors @ weighted
        if by_vector is not None:
            more = _Adjoint.apply(by_vector, vectors, share, solved)
            left, left_of_mass = left + more[0], left_of_mass + more[1]
        by_stiffness = _at_places(left, vectors, places)
        by_mass = _at_places(left_of_mass, vectors, mass_places)
        return by_stiffness, by_mass, None, None, None


class _Adjoint(torch.autograd.Function):  # type: ignore[misc]
    """What a function of the eigenvectors adds to the left factors of the gradients by W and B."""

    @staticmethod
    def forward(
        ctx: Any, by_vector: Tensor, vectors: Tensor, share: Tensor, solved: SolvedPencil
    ) -> tuple[Tensor, ...]:
        parts = pull_back(solved, to_numpy(by_vector), to_numpy(share))
        return tuple(torch.from_numpy(part).to(by_vector.device) for part in parts)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> None:
        raise InvalidParameterError(
            "Second derivatives of functions of eigenvectors are not computed; only those of "
            "eigenvalues are. Leave out create_graph=True."
        )


def _at_places(left: Tensor, right: Tensor, places: Tensor) -> Tensor:
    """Return the entries of the symmetric part of left rightᵀ at some places."""
    rows, columns = places
    if rows.equal(columns):
        return (left * right)[rows].sum(dim=1)
    # An entry and its mirror image are one number.
    ends = torch.stack([torch.minimum(rows, columns), torch.maximum(rows, columns)])
    keys, number = torch.unique(ends[0] * len(left) + ends[1], return_inverse=True)
    low, high = keys // len(left), keys % len(left)
    halves = [
        # Parts that fit into the cache: the rows of all entries are many times the vectors.
        (left[i] * right[j]).sum(dim=1) + (left[j] * right[i]).sum(dim=1)
        for i, j in zip(low.split(4096), high.split(4096), strict=True)
    ]
    return torch.cat(halves)[number] / 2
