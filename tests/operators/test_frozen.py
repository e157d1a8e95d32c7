import numpy as np
import pytest
import scipy.sparse as sp

from certeig.kit.matrices import freeze_sparse


def test_a_frozen_matrix_computes_and_does_not_change():
    unsorted = sp.csr_array((np.array([1.0, 2.0, 3.0]), [2, 0, 1], [0, 2, 3, 3]), shape=(3, 3))
    frozen = freeze_sparse(unsorted)
    for part in (frozen.data, frozen.indices, frozen.indptr):
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 1
    assert frozen.has_sorted_indices
    np.testing.assert_array_equal(frozen @ np.ones(3), [3, 3, 0])
    np.testing.assert_array_equal((frozen + frozen.T).toarray(), (unsorted + unsorted.T).toarray())
    unsorted.data[0] = 7  # the caller's own matrix stays free
    assert frozen[0, 2] == 1
