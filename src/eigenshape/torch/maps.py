"""Functional maps as layers, and losses on maps and spectra."""

from typing import Any

import torch
from torch import Tensor

from certeig.kit.arguments import describe_value, require_type
from certeig.kit.arrays import positive_number
from certeig.kit.errors import InvalidParameterError
from eigenshape.spectral.spectrum import NULL
from eigenshape.torch.operators import as_tensor
from eigenshape.torch.shapes import ShapeTensors
from eigenshape.torch.spectrum import TensorSpectrum

# Of the commutativity penalty, as Donati, Sharma and Ovsjanikov 2020 take it.
COMMUTING = 1e-3
Basis = TensorSpectrum | ShapeTensors


def coefficients(basis: Basis, functions: Any) -> Tensor:
    """Return the coefficients ΦᵀB f of functions, (k, q), in the eigenvectors of a shape.

    Parameters
    ----------
    basis : TensorSpectrum or ShapeTensors
    functions : (n, q) tensor
        Taken over to the precision of the basis, as features of networks have single precision.

    Returns
    -------
    (k, q) tensor

    Raises
    ------
    InvalidParameterError
        If the functions have another shape, or the basis is neither of the two.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 4)
    >>> et.coefficients(spectrum, torch.tensor(ball.vertices)).shape
    torch.Size([4, 3])
    """
    values = _on_points(basis, functions, "functions")
    weighted = basis.mass[:, None] * values if basis.mass.ndim == 1 else basis.mass @ values
    return basis.eigenvectors.T @ weighted


def _on_points(basis: Any, functions: Any, name: str) -> Tensor:
    """Return functions on the points of a shape in the precision of its basis.

    Raise an InvalidParameterError if they are not one row for each point.
    """
    if not isinstance(basis, Basis):
        raise InvalidParameterError(
            "A basis must be a TensorSpectrum or ShapeTensors; the value is "
            f"{describe_value(basis)}. Pass et.solve_spectrum(vertices, faces, k) or "
            "et.shape_tensors(mesh, bundle)."
        )
    values = as_tensor(functions).to(basis.eigenvectors)
    n = len(basis.eigenvectors)
    if values.ndim != 2 or len(values) != n:
        raise InvalidParameterError(
            f"{name} must have shape (n, q), one row for each of the {n} points; the shape is "
            f"{tuple(values.shape)}."
        )
    return values


def functional_map(
    source: Basis,
    target: Basis,
    features: Any,
    target_features: Any,
    *,
    commuting: float = COMMUTING,
) -> Tensor:
    """Compute the functional map that takes features of one shape to those of another, as a layer.

    C minimizes |C A - A'|² / q + μ Σ_ij (λ'_i - λ_j)² C_ij² / λ_max² with the coefficients A and A'
    of q features (Donati, Sharma and Ovsjanikov 2020). Each row of C solves a linear system, so
    gradients reach the features and the spectra. Coefficients of both shapes are in B-orthonormal
    eigenvectors, so the shapes should have one size.

    Parameters
    ----------
    source, target : TensorSpectrum or ShapeTensors
    features : (n, q) tensor
        On the points of the source.
    target_features : (n', q) tensor
    commuting : float
        μ, above 0.

    Returns
    -------
    (k', k) tensor
        Maps coefficients on the source to coefficients on the target.

    Raises
    ------
    InvalidParameterError
        If the numbers of features differ or are not of these points, or `commuting` is not
        positive.

    Examples
    --------
    The map of a shape to itself is the identity:

    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> horse = es.make_creature("quadruped", n_vertices=500)
    >>> spectrum = et.solve_spectrum(horse.vertices, horse.faces, 6)
    >>> features = torch.tensor(horse.vertices[:, [0, 1, 2, 0, 1, 2]] ** [1, 1, 1, 2, 2, 2])
    >>> mapping = et.functional_map(spectrum, spectrum, features, features)
    >>> bool((mapping - torch.eye(6)).abs().max() < 1e-3)
    True
    """
    weight = positive_number(commuting, "commuting")
    ours, theirs = coefficients(source, features), coefficients(target, target_features)
    theirs = theirs.to(ours)
    q, columns = ours.shape[1], theirs.shape[1]
    if q != columns:
        raise InvalidParameterError(
            f"Both shapes must have as many features; there are {q} and {columns}."
        )
    penalties = weight * _commutators(source, target) ** 2
    systems = (ours @ ours.T) / q + torch.diag_embed(penalties)
    return torch.linalg.solve(systems, (theirs @ ours.T) / q)


def _commutators(source: Basis, target: Basis) -> Tensor:
    """Return (λ'_i - λ_j) / λ_max."""
    own, other = source.eigenvalues, target.eigenvalues.to(source.eigenvalues)
    return (other[:, None] - own) / torch.maximum(own[-1], other[-1]).detach()


def map_from_features(
    source: Basis,
    target: Basis,
    features: Any,
    target_features: Any,
    *,
    temperature: float = 0.07,
) -> Tensor:
    """Compute the functional map of the soft correspondence by features.

    C = Φ'ᵀB' Π Φ, with Π_xy = softmax_y(f'(x)·f(y) / τ) for features of length 1 (Cao and
    Bernard 2022).

    Parameters
    ----------
    source, target : TensorSpectrum or ShapeTensors
    features : (n, q) tensor
    target_features : (n', q) tensor
    temperature : float
        τ, above 0. Less makes the correspondence harder.

    Returns
    -------
    (k', k) tensor

    Raises
    ------
    InvalidParameterError
        If the temperature is not positive, or features are not of these points.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 4)
    >>> features = torch.tensor(ball.vertices)
    >>> et.map_from_features(spectrum, spectrum, features, features).shape
    torch.Size([4, 4])
    """
    softness = positive_number(temperature, "temperature")
    ours, theirs = (
        torch.nn.functional.normalize(_on_points(basis, each, "features"), dim=1)
        for basis, each in ((source, features), (target, target_features))
    )
    shares = torch.softmax(theirs.to(ours) @ ours.T / softness, dim=1)
    return coefficients(target, shares @ source.eigenvectors)


def map_penalties(
    mapping: Tensor, inverse: Tensor, source: Basis, target: Basis
) -> tuple[Tensor, Tensor, Tensor]:
    """Compute what a pair of functional maps lacks, to learn maps without labels.

    Bijectivity |C C' - I|² + |C' C - I|², orthogonality |CᵀC - I|² + |C'ᵀC' - I|², and
    commutativity with the Laplacians, as means over entries (Roufosse, Sharma and Ovsjanikov 2019).

    Parameters
    ----------
    mapping : (k', k) tensor
        From the source to the target.
    inverse : (k, k') tensor
    source, target : TensorSpectrum or ShapeTensors

    Returns
    -------
    bijectivity, orthogonality, commutativity : tensor
        Three numbers.

    Raises
    ------
    InvalidParameterError
        If a map has not the sizes of the two bases.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 4)
    >>> identity = torch.eye(4, dtype=torch.float64)
    >>> [part.item() for part in et.map_penalties(identity, identity, spectrum, spectrum)]
    [0.0, 0.0, 0.0]
    """

    def off_identity(product: Tensor) -> Tensor:
        return (product - torch.eye(len(product), dtype=product.dtype)).square().mean()

    commutators = _commutators(source, target)
    sizes = tuple(commutators.shape)
    for name, each, size in (("mapping", mapping, sizes), ("inverse", inverse, sizes[::-1])):
        if tuple(each.shape) != size:
            raise InvalidParameterError(
                f"{name} must have shape {size}, the numbers of eigenvectors of the two shapes; the "
                f"shape is {tuple(each.shape)}."
            )
    return (
        off_identity(mapping @ inverse) + off_identity(inverse @ mapping),
        off_identity(mapping.T @ mapping) + off_identity(inverse.T @ inverse),
        (commutators * mapping).square().mean() + (commutators.T * inverse).square().mean(),
    )


def spectral_loss(spectrum: TensorSpectrum, targets: Any) -> Tensor:
    """Compute the mean of ((λ_i - μ_i) / μ_i)² over the targets μ_i above 0.

    A group of eigenvalues that are not separated moves as one: its eigenvalues share the mean of
    their derivatives.

    Parameters
    ----------
    spectrum : TensorSpectrum
    targets : (m,) tensor
        Ascending, in 1/length², for the first m ≤ k eigenvalues.

    Returns
    -------
    tensor
        One number.

    Raises
    ------
    InvalidParameterError
        If there are more targets than eigenvalues, none above 0, or one is not finite.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> spectrum = et.solve_spectrum(ball.vertices, ball.faces, 4)
    >>> et.spectral_loss(spectrum, spectrum.eigenvalues).item()
    0.0
    """
    require_type(spectrum, TensorSpectrum, "spectrum")
    targets = as_tensor(targets).to(spectrum.eigenvalues)
    if targets.ndim != 1 or not targets.isfinite().all():
        raise InvalidParameterError(
            "targets must be finite numbers in one row; the shape is "
            f"{tuple(targets.shape)}, and {int((~targets.isfinite()).sum())} are not finite."
        )
    positive = targets > NULL * targets[-1:]  # a computed 0 may be rounding
    if len(targets) > len(spectrum.eigenvalues) or not positive.any():
        raise InvalidParameterError(
            "targets must hold eigenvalues above 0, and no more than the spectrum; there are "
            f"{int(positive.sum())} above 0 of {len(targets)}, and {len(spectrum.eigenvalues)} in it."
        )
    parts = []
    for group in spectrum.groups:
        values = spectrum.eigenvalues[group]
        mean = values.mean()
        parts.append(mean + (values - mean).detach())
    values = torch.cat(parts)[: len(targets)][positive]
    return ((values - targets[positive]) / targets[positive]).square().mean()
