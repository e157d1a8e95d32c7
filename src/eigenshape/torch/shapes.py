"""Shapes as tensors: what networks on surfaces take, one by one and in batches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import positive_number
from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.spectral.tools.bundle import OperatorBundle, export_bundle
from eigenshape.torch.operators import as_tensor

# How far RᵀR of a rotation may be from I: some roundings of single precision.
ROTATION = 1e-5


@dataclass(frozen=True, eq=False)
class ShapeTensors:
    """One shape or a batch of shapes: the tensors of `es.spectral.OperatorBundle`, and the points.

    A batch is one large shape without edges between its parts: points are joined, matrices are
    block diagonal, and eigenvalues have one row for each shape.

    Attributes
    ----------
    points : (n, 3) tensor
    frames : (n, 3, 3) tensor
    mass : (n,) tensor
    stiffness : (n, n) sparse tensor
    eigenvalues : (k,) tensor, of a batch (b, k)
    eigenvectors : (n, k) tensor
    gradient_x, gradient_y : (n, n) sparse tensor
    labels : tensor or None
        Whatever was given with the shape.
    sizes : tuple of int
        Number of points of each shape.
    """

    points: Tensor
    frames: Tensor
    mass: Tensor
    stiffness: Tensor
    eigenvalues: Tensor
    eigenvectors: Tensor
    gradient_x: Tensor
    gradient_y: Tensor
    labels: Tensor | None = None
    sizes: tuple[int, ...] = ()

    def __repr__(self) -> str:
        pairs, count = self.eigenvectors.shape[1], len(self.sizes)
        shapes = f"{count} shapes, " if count > 1 else ""
        return f"ShapeTensors({shapes}{len(self.points)} points, {pairs} eigenpairs)"

    def to(self, place: Any) -> ShapeTensors:
        """Return the shape on another device, or with numbers of another precision."""
        moved: dict[str, Any] = {
            each.name: getattr(self, each.name).to(place)
            for each in fields(self)
            if isinstance(getattr(self, each.name), Tensor) and each.name != "labels"
        }
        if self.labels is not None and not isinstance(place, torch.dtype):
            moved["labels"] = self.labels.to(place)
        return replace(self, **moved)


def shape_tensors(
    shape: ShapeLike,
    bundle: OperatorBundle,
    labels: Any = None,
    *,
    dtype: torch.dtype = torch.float32,
) -> ShapeTensors:
    """Convert a shape and its operators to tensors.

    Parameters
    ----------
    shape : ShapeLike
        A mesh or a point cloud.
    bundle : OperatorBundle
        Of that shape.
    labels : array, optional
        Kept as a tensor.
    dtype : torch.dtype
        Of the real numbers.

    Returns
    -------
    ShapeTensors

    Raises
    ------
    InvalidParameterError
        If the bundle has another number of points.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> et.shape_tensors(ball, es.spectral.operator_bundle(ball, 16)).eigenvectors.shape
    torch.Size([162, 16])
    """
    require_type(bundle, OperatorBundle, "bundle")
    points = as_shape(shape).points
    if len(points) != len(bundle.mass):
        raise InvalidParameterError(
            "A bundle must be of the shape beside it; it has "
            f"{len(bundle.mass)} points and the shape has {len(points)}."
        )
    kept = None if labels is None else torch.tensor(np.asarray(labels))
    places = torch.tensor(points, dtype=dtype)
    return ShapeTensors(places, **bundle_tensors(bundle, dtype), labels=kept, sizes=(len(points),))


def bundle_tensors(bundle: OperatorBundle, place: Any) -> dict[str, Tensor]:
    """Return the operators by name, with the precision or on the device of `place`."""
    tensors = export_bundle(bundle, "torch", "double")
    return {name: part.to(place) for name, part in zip(vars(bundle), tensors, strict=True)}


def join_shapes(shapes: Sequence[ShapeTensors]) -> ShapeTensors:
    """Join shapes to one batch; give it as `collate_fn` to a DataLoader.

    Parameters
    ----------
    shapes : sequence of ShapeTensors
        With one number of eigenpairs each.

    Returns
    -------
    ShapeTensors

    Raises
    ------
    InvalidParameterError
        If there is no shape, or the numbers of eigenpairs differ.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> meshes = [es.icosphere(1), es.icosphere(2)]
    >>> bundles = [es.spectral.operator_bundle(mesh, 8) for mesh in meshes]
    >>> batch = et.join_shapes([et.shape_tensors(*pair) for pair in zip(meshes, bundles)])
    >>> batch.sizes, batch.eigenvalues.shape
    ((42, 162), torch.Size([2, 8]))
    """
    require_each(shapes, ShapeTensors, "shapes")
    counts = {each.eigenvectors.shape[1] for each in shapes}
    if len(counts) != 1:
        raise InvalidParameterError(
            f"A batch must hold shapes with one number of eigenpairs; the numbers are {sorted(counts)}."
        )
    joined: dict[str, Any] = {"sizes": tuple(size for each in shapes for size in each.sizes)}
    for name in ("points", "frames", "mass", "eigenvectors"):
        joined[name] = torch.cat([getattr(each, name) for each in shapes])
    for name in ("stiffness", "gradient_x", "gradient_y"):
        joined[name] = _block_diagonal([getattr(each, name) for each in shapes])
    joined["eigenvalues"] = torch.cat([torch.atleast_2d(each.eigenvalues) for each in shapes])
    labels = [each.labels for each in shapes if each.labels is not None]
    joined["labels"] = torch.cat([torch.atleast_1d(each) for each in labels]) if labels else None
    return ShapeTensors(**joined)


def _block_diagonal(blocks: list[Tensor]) -> Tensor:
    starts = np.cumsum([0, *(len(block) for block in blocks)]).tolist()
    places = torch.cat(
        [block.indices() + start for block, start in zip(blocks, starts[:-1], strict=True)], dim=1
    )
    values = torch.cat([block.values() for block in blocks])
    options = {"is_coalesced": True, "check_invariants": False}
    return torch.sparse_coo_tensor(places, values, (starts[-1],) * 2, **options)


def move_shape(shape: ShapeTensors, rotation: Tensor, scale: float = 1.0) -> ShapeTensors:
    """Turn and scale a shape; its operators follow exactly, without being computed again.

    Under x → s R x the mass becomes s² as large, eigenvalues s⁻², eigenvectors and gradients s⁻¹;
    frames turn along, and nothing else changes.

    Parameters
    ----------
    shape : ShapeTensors
    rotation : (3, 3) tensor
        R, with RᵀR = I and determinant 1.
    scale : float
        s > 0.

    Returns
    -------
    ShapeTensors

    Raises
    ------
    InvalidParameterError
        If the scale is not positive, or the matrix is not a rotation: the operators would not be
        those of the moved shape.

    Examples
    --------
    >>> import torch, eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(2)
    >>> shape = et.shape_tensors(ball, es.spectral.operator_bundle(ball, 4))
    >>> large = et.move_shape(shape, et.random_rotation(), 2.0)
    >>> round((large.eigenvalues[1] / shape.eigenvalues[1]).item(), 6)
    0.25
    """
    s = positive_number(scale, "scale")
    R = as_tensor(rotation).to(shape.points)
    if R.shape != (3, 3) or (R.T @ R - torch.eye(3).to(R)).abs().max() > ROTATION or R.det() < 0:
        raise InvalidParameterError(
            "rotation must be a 3 x 3 matrix R with RᵀR = I and determinant 1; it is "
            f"{R.tolist()}. Pass et.random_rotation()."
        )
    return replace(
        shape,
        points=s * shape.points @ R.T,
        frames=shape.frames @ R.T,
        mass=s**2 * shape.mass,
        eigenvalues=shape.eigenvalues / s**2,
        eigenvectors=shape.eigenvectors / s,
        gradient_x=shape.gradient_x / s,
        gradient_y=shape.gradient_y / s,
    )


def random_rotation(generator: torch.Generator | None = None) -> Tensor:
    """Return a random rotation matrix, (3, 3), even over all rotations.

    Parameters
    ----------
    generator : torch.Generator, optional

    Returns
    -------
    (3, 3) tensor

    Examples
    --------
    >>> import eigenshape.torch as et
    >>> round(et.random_rotation().det().item(), 6)
    1.0
    """
    Q, R = torch.linalg.qr(torch.randn(3, 3, generator=generator, dtype=torch.float64))
    Q = Q * R.diagonal().sign()
    return Q * Q.det()  # of odd dimension: a reflection times -1 is a rotation
