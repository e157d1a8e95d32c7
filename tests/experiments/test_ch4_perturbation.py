"""Points moved by noise: what the README claims."""

import numpy as np
import pytest
from quick_forms import largest


@pytest.mark.long
def test_changes_grow_with_the_noise_and_pass_the_floor(quick_form):
    for name, rows in quick_form("ch4_perturbation/run.py")["samples"].items():
        assert (np.diff(largest(rows)) > 0).all(), name
        for noise, row in rows.items():
            if noise != "M again":
                assert 4.2 < row["δ"]["mean"] / float(noise.split()[-1]) < 4.5
        floor = rows["M again"]["largest"]["mean"]
        assert largest(rows)[0] < floor < largest(rows)[-1], name
