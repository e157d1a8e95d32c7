"""The cotangent operator as a differentiable function of the vertices."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from certeig.kit.arguments import describe_value
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_sound


def as_tensor(array: Any) -> Tensor:
    """Return an array as a tensor of double precision, without a copy where DLPack or NumPy can.

    Tensors keep their graph and device. Arrays of JAX and others come in by DLPack.
    """
    if not isinstance(array, Tensor):
        writable = not isinstance(array, np.ndarray) or array.flags.writeable
        try:
            array = (
                torch.from_dlpack(array)
                if hasattr(array, "__dlpack__") and writable
                else torch.tensor(array)
            )
        except (RuntimeError, TypeError, ValueError) as err:
            remedy = (
                " Pass mesh.vertices and mesh.faces." if isinstance(array, TriangleMesh) else ""
            )
            raise InvalidParameterError(
                "Numbers must be in a tensor or an array; the value is "
                f"{describe_value(array)}.{remedy}"
            ) from err
    return require_numbers(array).to(torch.float64)


def require_numbers(tensor: Tensor) -> Tensor:
    """Return a tensor; raise an error unless it is dense, real and holds numbers."""
    if tensor.is_meta or tensor.is_complex() or tensor.layout != torch.strided or tensor.is_nested:
        raise InvalidParameterError(
            "A tensor must be dense, of real numbers, and on a device that keeps them; this one is of "
            f"{tensor.dtype} and layout {tensor.layout}, on {tensor.device}. Call its method to_dense(), "
            "take its real part, or make it on the CPU."
        )
    return tensor


def to_numpy(tensor: Tensor) -> np.ndarray:
    """Return the values of a tensor as an array; on the CPU it shares their memory."""
    return tensor.detach().cpu().numpy()


def checked_mesh(vertices: Tensor, faces: Tensor) -> TriangleMesh:
    """Return a mesh that can carry an operator; raise InvalidShapeError for one that cannot."""
    mesh = TriangleMesh(to_numpy(vertices), to_numpy(faces))
    require_sound(mesh)
    return mesh


def as_faces(faces: Any) -> Tensor:
    """Return faces as a tensor of int64; raise InvalidShapeError if they are not whole numbers."""
    numbers = to_numpy(require_numbers(faces)) if isinstance(faces, Tensor) else np.asarray(faces)
    if numbers.dtype.kind not in "iuf" or not np.equal(numbers, np.trunc(numbers)).all():
        raise InvalidShapeError(
            f"faces must be whole numbers in a tensor or an array; the value is {describe_value(faces)} "
            f"of {numbers.dtype}. Pass mesh.faces."
        )
    return (faces if isinstance(faces, Tensor) else torch.tensor(numbers)).to(torch.int64)


def face_products(vertices: Tensor, faces: Tensor) -> tuple[Tensor, Tensor]:
    """Return the cotangent at each corner of each face, (f, 3), and the areas of the faces, (f,)."""
    corners = vertices[faces]
    following, before = corners.roll(-1, dims=1) - corners, corners.roll(1, dims=1) - corners
    doubled = torch.linalg.cross(following[:, 0], before[:, 0], dim=1).norm(dim=1)
    return (following * before).sum(dim=2) / doubled[:, None], doubled / 2


def cotangent_entries(vertices: Tensor, faces: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return the places (2, e) and values (e,) of W, row by row, and the diagonal of B.

    Raise InvalidShapeError for a mesh that cannot carry an operator.
    """
    checked_mesh(vertices, faces)
    n = len(vertices)
    # Divided by a power of two, which costs no digit: squares of any coordinates are floats.
    _, scale = size_one(to_numpy(vertices))
    cotangents, areas = face_products(vertices / scale, faces)
    # The side opposite to each corner; a side of several faces has the sum of their weights.
    ends = torch.stack([faces.roll(-1, dims=1), faces.roll(1, dims=1)]).flatten(1).sort(dim=0)
    sides = ends.values.cpu().numpy()
    keys, number = np.unique(sides[0] * n + sides[1], return_inverse=True)
    low, high = keys // n, keys % n
    diagonal = np.arange(n)
    rows, columns = np.concatenate([[low, high], [high, low], [diagonal] * 2], axis=1)
    order = torch.from_numpy(np.argsort(rows * n + columns)).to(vertices.device)

    def gather(places: Any, values: Tensor, size: int) -> Tensor:
        where = torch.as_tensor(places, device=vertices.device)
        return values.new_zeros(size).index_add(0, where, values)

    weights = gather(number, cotangents.flatten() / 2, len(keys))
    sums = gather(np.concatenate([low, high]), torch.cat([weights, weights]), n)
    values = torch.cat([-weights, -weights, sums])[order]
    places = torch.from_numpy(np.stack([rows, columns])).to(vertices.device)[:, order]
    mass = gather(faces.flatten(), (areas / 3).repeat_interleave(3), n) * scale**2
    return places, values, mass


def cotangent_laplacian(vertices: Any, faces: Any) -> tuple[Tensor, Tensor]:
    """Build the cotangent operator W and its lumped mass B, differentiable in the vertices.

    The values are those of `es.cotangent_laplacian`, to rounding.

    Parameters
    ----------
    vertices : (n, 3) float tensor
        Or any array that DLPack or NumPy takes. Computed in double precision.
    faces : (f, 3) int tensor

    Returns
    -------
    stiffness : (n, n) sparse COO tensor
        W, coalesced.
    mass : (n,) tensor
        The diagonal of B, in length².

    Raises
    ------
    InvalidShapeError
        As in `es.cotangent_laplacian`.

    Examples
    --------
    >>> import eigenshape as es, eigenshape.torch as et
    >>> ball = es.icosphere(1)
    >>> W, mass = et.cotangent_laplacian(ball.vertices, ball.faces)
    >>> abs(W.to_dense().numpy() - es.cotangent_laplacian(ball).stiffness).max().round(9).item()
    0.0
    """
    points = as_tensor(vertices)
    places, values, mass = cotangent_entries(points, as_faces(faces))
    size = (len(points), len(points))
    options = {"is_coalesced": True, "check_invariants": False}
    return torch.sparse_coo_tensor(places, values, size, **options), mass
