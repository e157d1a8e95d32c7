"""Functions on two shapes that a map should carry into each other, and the operators that they give."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import describe_value
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions
from eigenshape.spectral.diffusion.decay import decay_factors
from eigenshape.spectral.maps.functional_map import unit_modes, unit_projector
from eigenshape.spectral.signatures.heat import default_times
from eigenshape.spectral.signatures.wave import default_energies, wave_bands
from eigenshape.spectral.spectrum import Spectrum

SIGNATURES = ("waves", "heat")
N_FUNCTIONS = 20  # of each signature
WAVE_STEP = 5  # every fifth energy: neighbors are nearly alike, because bands are 7 steps wide
CONSTANT = 1e-9  # deviation of a function, relative to its size, below which it counts as constant


def descriptor_functions(
    source: Spectrum,
    target: Spectrum,
    descriptors: str | Sequence[ArrayLike],
    ends: Int[np.ndarray, "p 2"],
) -> tuple[Float[np.ndarray, "n1 q"], Float[np.ndarray, "n2 q"]]:
    """Return functions of mean 0 and norm 1 on both shapes, without those that are constant.

    Raise InvalidParameterError if `descriptors` names no signature, its arrays do not fit the
    shapes or each other, or all functions are constant.
    """
    shapes = (source, target)
    if isinstance(descriptors, str):
        if descriptors not in SIGNATURES:
            raise InvalidParameterError(
                f'descriptors must be "waves", "heat" or a pair of arrays; the value is {descriptors!r}.'
            )
        # Signatures, and the kernels from the points of each pair, in the same bands of λ × area
        areas = [shape.point_areas.sum() for shape in shapes]
        both = []
        for shape, area, points in zip(shapes, areas, ends.T, strict=True):
            if descriptors == "waves":
                energies, sigma = default_energies(source, N_FUNCTIONS * WAVE_STEP)
                bands = wave_bands(shape, energies[::WAVE_STEP] + np.log(areas[0] / area), sigma)
            else:
                bands = decay_factors(shape, default_times(source, N_FUNCTIONS) * (area / areas[0]))
            modes = unit_modes(shape, len(shape.eigenvalues))[:, -len(bands) :]
            kernels = [(modes * modes[point]) @ bands for point in points]
            both.append(np.concatenate([modes**2 @ bands, *kernels], axis=1))
    elif isinstance(descriptors, tuple | list) and len(descriptors) == 2:
        both = [
            point_functions(values, f"descriptors[{number}]", len(shape.eigenvectors))
            for number, (values, shape) in enumerate(zip(descriptors, shapes, strict=True))
        ]
        both = [values.reshape(len(values), -1) for values in both]
    else:
        raise InvalidParameterError(
            f"descriptors must be a pair of arrays, one for each shape; the value is "
            f"{describe_value(descriptors)}."
        )
    if both[0].shape[1] != both[1].shape[1]:
        raise InvalidParameterError(
            f"descriptors must hold as many functions on the source as on the target; there are "
            f"{both[0].shape[1]} and {both[1].shape[1]}."
        )
    norms = []
    for number, (functions, shape) in enumerate(zip(both, shapes, strict=True)):
        shares = shape.point_areas / shape.point_areas.sum()
        largest = np.abs(functions).max(axis=0)
        scaled = functions / np.where(largest > 0, largest, 1)
        both[number] = scaled - shares @ scaled
        norms.append(np.sqrt(shares @ both[number] ** 2))
    varied = np.minimum(*norms) > CONSTANT
    if not varied.any():
        raise InvalidParameterError(
            "A descriptor must vary on both shapes; all of these are constant on one of them. Pass pairs instead."
        )
    ours, theirs = (
        functions[:, varied] / norm[varied] for functions, norm in zip(both, norms, strict=True)
    )
    return ours, theirs


def product_operators(
    shape: Spectrum, functions: Float[np.ndarray, "n q"], k: int
) -> Float[np.ndarray, "q k k"]:
    """Return, for each function f, the product with f: ∫ φ_i f φ_j."""
    modes, projector = unit_modes(shape, k), unit_projector(shape, k)
    return np.stack([projector.T @ (function[:, None] * modes) for function in functions.T])


def orientation_operators(
    shape: Spectrum,
    functions: Float[np.ndarray, "n q"],
    faces: Int[np.ndarray, "f 3"],
    k: int,
) -> Float[np.ndarray, "q k k"]:
    """Return, for each function f, the operator ∫ φ_i ⟨∇f × ∇φ_j, n⟩.

    On a triangle (a, b, c) the integral of ⟨∇f × ∇g, n⟩ is half the determinant of the differences
    of f and g along ab and ac: only the order of corners matters, no length does.
    """
    modes = unit_modes(shape, k)[faces]
    means = modes.mean(axis=1)
    along_ab, along_ac = modes[:, 1] - modes[:, 0], modes[:, 2] - modes[:, 0]
    operators = []
    for function in functions.T:
        corners = function[faces]
        ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        operators.append(means.T @ (ab[:, None] * along_ac - ac[:, None] * along_ab) / 2)
    return np.stack(operators)
