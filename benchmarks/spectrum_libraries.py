"""How a user of each library asks for the lowest eigenpairs, as its own documentation does.

Solvers are imported where they are called, so that a process loads only the library that it measures.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

import eigenshape as es

Shape = dict[str, Any]  # vertices (n, 3) and faces (f, 3), or a symmetric adjacency matrix
Matrices = tuple[sp.csc_array, sp.csc_array]


@dataclass(frozen=True)
class Library:
    """One way to a spectrum.

    Attributes
    ----------
    build : shape -> state
        What comes before the solve: matrices, or an object that has them.
    solve : state, k -> values or None, vectors
        None where a library returns only vectors.
    matrices : state -> W, B
        The pencil that was solved, with our sign (docs/operators.md).
    takes : "mesh" or "graph"
    package : str
        Its name in the package index.
    call : str
        What the user writes.
    """

    build: Callable[[Shape], Any]
    solve: Callable[[Any, int], tuple[np.ndarray | None, np.ndarray]]
    matrices: Callable[[Any], tuple[sp.sparray, sp.sparray]]
    takes: str
    package: str
    call: str


def pencil(library: Library, state: object) -> Matrices:
    """Return W and B of a library, symmetric to the last digit."""
    stiffness, mass = (sp.csc_array(matrix, dtype=np.float64) for matrix in library.matrices(state))
    return sp.csc_array((stiffness + stiffness.T) / 2), sp.csc_array((mass + mass.T) / 2)


def _our_mesh(shape: Shape) -> es.Laplacian:
    return es.cotangent_laplacian(es.TriangleMesh(shape["vertices"], shape["faces"]))


def _our_graph(shape: Shape) -> es.Laplacian:
    return es.operators.graph_laplacian(shape["adjacency"], "normalized")


def _our_solve(laplacian: es.Laplacian, k: int) -> tuple[np.ndarray, np.ndarray]:
    spectrum = es.solve_spectrum(laplacian, k)
    return spectrum.eigenvalues, spectrum.eigenvectors


def _our_matrices(laplacian: es.Laplacian) -> tuple[sp.sparray, sp.sparray]:
    return laplacian.stiffness, laplacian.mass


def _arpack(laplacian: es.Laplacian, k: int) -> tuple[np.ndarray, np.ndarray]:
    return spl.eigsh(laplacian.stiffness.tocsc(), k, laplacian.mass.tocsc(), sigma=-0.01)


def arpack_with(
    factor: Callable[[sp.csc_array], Callable[..., np.ndarray]],
    stiffness: sp.csc_array,
    mass: sp.csc_array,
    k: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Call ARPACK with solves of W + 0.01 B by another library."""
    shifted = sp.csc_array(stiffness + 0.01 * mass)
    shifted.sort_indices()
    inverse = spl.LinearOperator(shifted.shape, matvec=factor(shifted), dtype=np.float64)
    return spl.eigsh(stiffness, k, mass, sigma=-0.01, OPinv=inverse)


def cholmod_factor(matrix: sp.csc_array) -> Callable[..., np.ndarray]:
    """Factor a matrix by CHOLMOD, as cholespy calls it, and return what solves with it."""
    from cholespy import CholeskySolverD, MatrixType

    places = matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32)
    solver = CholeskySolverD(matrix.shape[0], *places, matrix.data, MatrixType.CSC)
    found = np.empty(matrix.shape[0])

    def solve(right: np.ndarray) -> np.ndarray:
        solver.solve(np.ascontiguousarray(right, dtype=np.float64).ravel(), found)
        return found.copy()

    return solve


def _pardiso_factor(matrix: sp.csc_array) -> Callable[..., np.ndarray]:
    from pypardiso import PyPardisoSolver

    upper, solver = sp.csr_matrix(sp.triu(matrix)), PyPardisoSolver(mtype=2)
    upper.sort_indices()
    solver.set_phase(12)
    solver._call_pardiso(upper, np.zeros((matrix.shape[0], 1)))
    solver.set_phase(33)
    return lambda right: solver._call_pardiso(upper, right.reshape(-1, 1)).ravel()


def _arpack_by(
    factor: Callable[[sp.csc_array], Callable[..., np.ndarray]],
) -> Callable[[es.Laplacian, int], tuple[np.ndarray, np.ndarray]]:
    return lambda laplacian, k: arpack_with(
        factor, laplacian.stiffness.tocsc(), laplacian.mass.tocsc(), k
    )


def _lapy(**options: bool) -> Callable[[Shape], Any]:
    def build(shape: Shape) -> object:
        import lapy

        return lapy.Solver(lapy.TriaMesh(shape["vertices"], shape["faces"]), **options)

    return build


def _lapy_solve(solver: Any, k: int) -> Any:
    return solver.eigs(k)


def _lapy_matrices(solver: Any) -> Any:
    return solver.stiffness, solver.mass


def _robust(shape: Shape) -> tuple[sp.sparray, sp.sparray]:
    import robust_laplacian

    return robust_laplacian.mesh_laplacian(shape["vertices"], shape["faces"])


def _igl(shape: Shape) -> tuple[sp.sparray, sp.sparray]:
    import igl

    vertices, faces = shape["vertices"], shape["faces"]
    return -igl.cotmatrix(vertices, faces), igl.massmatrix(
        vertices, faces, igl.MASSMATRIX_TYPE_VORONOI
    )


def _igl_eigs(state: tuple[sp.sparray, sp.sparray], k: int) -> tuple[np.ndarray, np.ndarray]:
    from igl import spectra

    vectors, values = spectra.eigs(
        sp.csc_matrix(state[0]), sp.csc_matrix(state[1]), k, spectra.EIGS_TYPE_SM
    )
    order = np.argsort(np.ravel(values))  # it returns them descending
    return np.ravel(values)[order], vectors[:, order]


def _pyfm(shape: Shape) -> object:
    from pyFM.mesh import TriMesh

    return TriMesh(shape["vertices"], shape["faces"])


def _pyfm_solve(mesh: Any, k: int) -> tuple[np.ndarray, np.ndarray]:
    mesh.process(k=k)
    return mesh.eigenvalues, mesh.eigenvectors


def _sklearn(shape: Shape) -> sp.csr_matrix:
    adjacency = sp.csr_matrix(shape["adjacency"])
    adjacency.indices, adjacency.indptr = (
        adjacency.indices.astype(np.int32),
        adjacency.indptr.astype(np.int32),
    )
    return adjacency  # the indices that it takes


def _sklearn_solve(adjacency: sp.csr_array, k: int) -> tuple[None, np.ndarray]:
    from sklearn.manifold import spectral_embedding

    return None, spectral_embedding(
        adjacency, n_components=k, eigen_solver="arpack", random_state=0, drop_first=False
    )


def _normalized(adjacency: sp.csr_array) -> tuple[sp.sparray, sp.sparray]:
    return _our_matrices(es.operators.graph_laplacian(adjacency, "normalized"))


LIBRARIES = {
    "eigenshape": Library(
        _our_mesh,
        _our_solve,
        _our_matrices,
        "mesh",
        "eigenshape",
        "solve_spectrum(cotangent_laplacian(mesh), k)",
    ),
    "scipy ARPACK": Library(
        _our_mesh, _arpack, _our_matrices, "mesh", "scipy", "eigsh(W, k, B, sigma=-0.01)"
    ),
    "ARPACK, cholespy": Library(
        _our_mesh,
        _arpack_by(cholmod_factor),
        _our_matrices,
        "mesh",
        "cholespy",
        "eigsh(W, k, B, sigma=-0.01, OPinv=...), factors by CHOLMOD",
    ),
    "ARPACK, PARDISO": Library(
        _our_mesh,
        _arpack_by(_pardiso_factor),
        _our_matrices,
        "mesh",
        "pypardiso",
        "eigsh(W, k, B, sigma=-0.01, OPinv=...), factors by the MKL",
    ),
    "LaPy": Library(
        _lapy(),
        _lapy_solve,
        _lapy_matrices,
        "mesh",
        "lapy",
        "Solver(TriaMesh(v, f)).eigs(k)",
    ),
    "LaPy, lumped": Library(
        _lapy(lump=True),
        _lapy_solve,
        _lapy_matrices,
        "mesh",
        "lapy",
        "Solver(TriaMesh(v, f), lump=True).eigs(k)",
    ),
    "LaPy, CHOLMOD": Library(
        _lapy(use_cholmod=True),
        _lapy_solve,
        _lapy_matrices,
        "mesh",
        "cholespy",
        "Solver(TriaMesh(v, f), use_cholmod=True).eigs(k)",
    ),
    "robust_laplacian": Library(
        _robust,
        lambda state, k: spl.eigsh(state[0], k, state[1], sigma=1e-8),
        lambda state: state,
        "mesh",
        "robust_laplacian",
        "eigsh(L, k, M, sigma=1e-8)",
    ),
    "libigl": Library(
        _igl,
        lambda state, k: spl.eigsh(state[0], k, state[1], sigma=0, which="LM"),
        lambda state: state,
        "mesh",
        "libigl",
        'eigsh(-cotmatrix(v, f), k, massmatrix(v, f), sigma=0, which="LM")',
    ),
    "libigl, eigs": Library(
        _igl, _igl_eigs, lambda state: state, "mesh", "libigl", "spectra.eigs(W, M, k, SM)"
    ),
    "pyFM": Library(
        _pyfm,
        _pyfm_solve,
        lambda mesh: (mesh.stiffness, mesh.mass),
        "mesh",
        "pyfmaps",
        "TriMesh(v, f).process(k=k)",
    ),
    "eigenshape, graph": Library(
        _our_graph,
        _our_solve,
        _our_matrices,
        "graph",
        "eigenshape",
        'solve_spectrum(graph_laplacian(A, "normalized"))',
    ),
    "scipy ARPACK, graph": Library(
        _our_graph, _arpack, _our_matrices, "graph", "scipy", "eigsh(D - A, k, D, sigma=-0.01)"
    ),
    "scikit-learn": Library(
        _sklearn,
        _sklearn_solve,
        _normalized,
        "graph",
        "scikit-learn",
        'spectral_embedding(A, n_components=k, eigen_solver="arpack", drop_first=False)',
    ),
}
OURS = {"mesh": "eigenshape", "graph": "eigenshape, graph"}
