"""Sparse matrices that nobody can change."""

import scipy.sparse as sp


def freeze_sparse(matrix: sp.csr_array) -> sp.csr_array:
    """Return a copy with sorted indices whose arrays are read-only."""
    copy = matrix.copy()
    copy.sum_duplicates()  # sorts, too: SciPy would do so later in place, where it no longer can
    for part in (copy.data, copy.indices, copy.indptr):
        part.flags.writeable = False
    return copy
