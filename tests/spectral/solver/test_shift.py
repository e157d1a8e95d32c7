from itertools import pairwise

import numpy as np
import pytest

from certeig.solver import shift
from eigenshape.geometry.facets import facet_table
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.operators.crouzeix_raviart import crouzeix_raviart_laplacian, facet_mass
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.domains import box
from eigenshape.spectral.pencils import normalize


@pytest.mark.parametrize("seed", [1, 2, 16, 24, 40])
def test_where_no_factor_serves_a_lower_shift_does(seed, monkeypatch):
    mesh, rng = box(5, 5, 5), np.random.default_rng(seed)
    uneven = simplex_volumes(mesh) * np.exp(2 * rng.standard_normal(mesh.n_simplices))
    mass = facet_mass(facet_table(mesh), uneven)
    pencil = normalize(Laplacian(crouzeix_raviart_laplacian(mesh).stiffness, mass))
    asked, serving = [], shift.factorize_near

    def watched(pencil, sigma):
        asked.append(sigma)
        return serving(pencil, sigma)

    monkeypatch.setattr(shift, "factorize_near", watched)
    factor = shift.shift_inside(pencil, 100)
    assert shift.ACCEPTED_SHARES[0] * 100 - 3 <= factor.count <= shift.ACCEPTED_SHARES[1] * 100 + 1
    assert any(
        later == pytest.approx(shift.LOWER_SHARES[1] * sooner) for sooner, later in pairwise(asked)
    )
