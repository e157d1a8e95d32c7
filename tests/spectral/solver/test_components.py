"""Shapes of many parts: each is solved by itself, and the whole is proved."""

import numpy as np
import pytest
import scipy.sparse as sp
from pencils import cycle, dense_eigenvalues, graph, path

from certeig.solver import strategy as roads
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.certify import certify
from eigenshape.spectral.multilevel import approximate
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum

pytestmark = pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")  # of pieces


def moved(mesh: TriangleMesh, scale: float, along: float) -> TriangleMesh:
    return TriangleMesh(scale * mesh.vertices + [along, 0, 0], mesh.faces)


def with_specks(big: TriangleMesh, n: int, scale: float = 0.03) -> TriangleMesh:
    return disjoint_union(big, *[moved(icosphere(2), scale, 3.0 + i) for i in range(n)])


@pytest.mark.long
@pytest.mark.parametrize("k", [1, 40, 41, 60])
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_a_sphere_with_forty_specks(mass, k):
    laplacian = cotangent_laplacian(with_specks(icosphere(3), 40), mass)
    spectrum = solve_spectrum(laplacian, k)
    sphere = solve_spectrum(cotangent_laplacian(icosphere(3), mass), 60).eigenvalues
    expected = np.concatenate([np.zeros(40), sphere])[
        :k
    ]  # the specks' next eigenvalue is 2/.03², above all of these
    assert sphere[-1] < 2 / 0.03**2
    np.testing.assert_allclose(spectrum.eigenvalues, expected, rtol=1e-11, atol=1e-12)
    assert spectrum.certificate.complete
    assert np.count_nonzero(spectrum.eigenvalues == 0) == min(k, 41), "one 0 a part"
    certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)


@pytest.mark.long
def test_parts_of_many_sizes_by_hand():
    """Cycles of m points have the eigenvalues 2 - 2 cos(2πj/m)."""
    sizes = [3, 700, 3, 350, 20, 301, 20]
    laplacian = graph(sp.block_diag([cycle(size) for size in sizes]))
    values = np.sort(
        np.concatenate([2 - 2 * np.cos(2 * np.pi * np.arange(size) / size) for size in sizes])
    )
    for k in (1, 5, 7, 30, 200, 700):
        found = solve_spectrum(laplacian, k)
        np.testing.assert_allclose(found.eigenvalues, values[:k], rtol=1e-9, atol=1e-13)
        assert found.certificate.n_found == found.certificate.count


def test_a_part_that_has_more_low_eigenvalues_than_expected_is_asked_again(monkeypatch):
    """A path has √λ low eigenvalues where a grid has λ: Weyl's law of surfaces says nothing of it."""
    asked = []
    honest = roads._solve_connected

    def listening(pencil, k, report):
        asked.append((pencil.n, k))
        return honest(pencil, k, report)

    monkeypatch.setattr(roads, "_solve_connected", listening)
    square = sp.kronsum(path(25), path(25))
    laplacian = graph(sp.block_diag([square, path(400)]))
    found = solve_spectrum(laplacian, 60)
    np.testing.assert_allclose(
        found.eigenvalues, dense_eigenvalues(laplacian)[:60], rtol=1e-9, atol=1e-12
    )
    assert [n for n, _ in asked].count(400) == 2, "more pairs of the path were asked for"


def test_equal_eigenvalues_stand_in_the_order_of_their_parts():
    """Four spheres, the large one in the middle; turned copies differ in the last digits."""
    turned = TriangleMesh(
        icosphere(2).vertices[:, [1, 2, 0]] @ np.diag([1, 1, -1.0]), icosphere(2).faces[:, ::-1]
    )
    mesh = disjoint_union(
        moved(turned, 1, 0), icosphere(3), moved(icosphere(2), 1, 7.0), moved(turned, 1, 1 / 3)
    )
    spectrum = solve_spectrum(cotangent_laplacian(mesh), 14)
    labels = np.repeat([0, 1, 2, 3], [162, 642, 162, 162])
    owners = [np.unique(labels[column != 0]).tolist() for column in spectrum.eigenvectors.T]
    assert owners[:4] == [[0], [1], [2], [3]]
    second = [
        owner for owner, value in zip(owners, spectrum.eigenvalues, strict=True) if 1 < value < 2.1
    ]
    small = [owner for owner in second if owner != [1]]
    assert small == sorted(small)
    assert len(small) >= 6
    assert (np.diff(spectrum.eigenvalues) >= 0).all()
    again = solve_spectrum(cotangent_laplacian(mesh), 14)
    np.testing.assert_array_equal(again.eigenvectors, spectrum.eigenvectors)


@pytest.mark.parametrize("scale", [1.0, 1e-2, 1e-4])
def test_specks_of_any_size_leave_the_shape_its_eigenvalues(scale):
    sphere = icosphere(3)
    found = solve_spectrum(cotangent_laplacian(with_specks(sphere, 20, scale=0.3 * scale)), 36)
    expected = solve_spectrum(cotangent_laplacian(sphere), 16).eigenvalues
    own = solve_spectrum(cotangent_laplacian(moved(icosphere(2), 0.3 * scale, 0.0)), 4).eigenvalues
    merged = np.sort(np.concatenate([expected, np.tile(own, 20)]))[:36]
    # The eigenvalue 0 of each part is found up to the rounding of the largest entries, those of the specks.
    np.testing.assert_allclose(found.eigenvalues[:21], 0, atol=1e-13 * own[-1])
    np.testing.assert_allclose(found.eigenvalues[21:], merged[21:], rtol=1e-8)
    assert found.certificate.complete


def test_an_interval_of_many_parts():
    laplacian = cotangent_laplacian(with_specks(icosphere(3), 40, scale=1.0))
    whole = solve_spectrum(laplacian, 500).eigenvalues
    low, high = 4.0, 9.0  # between the clusters at 2, 6 and 12
    inside = whole[(whole >= low) & (whole < high)]
    found = solve_spectrum(laplacian, above=low, below=high)
    np.testing.assert_allclose(found.eigenvalues, inside, rtol=1e-9)
    assert found.certificate.first == np.count_nonzero(whole < low)
    assert len(inside) == 41 * 5


def test_kernels_on_many_parts():
    mesh = with_specks(icosphere(3), 3, scale=0.5)
    laplacian = mesh_laplacian(mesh, correct="log")
    found = solve_spectrum(laplacian, 12)
    assert found.certificate.complete
    certify(laplacian, found.eigenvalues, found.eigenvectors)


def test_connected_parts_and_their_level():
    """Tiny parts have few of the low eigenvalues, and do not set the unit."""
    alone = normalize(cotangent_laplacian(grid(30, 30)))
    specks = cotangent_laplacian(
        disjoint_union(grid(30, 30), *[moved(icosphere(0), 1e-4, 2.0 + i) for i in range(5)])
    )
    pencil = normalize(specks)
    level, own = (
        pencil.values_out(np.array([pencil.level]))[0],
        alone.values_out(np.array([alone.level]))[0],
    )
    assert own < level < 1.1 * own
    assert np.bincount(pencil.labels).tolist() == [961, 12, 12, 12, 12, 12]
    assert not alone.labels.any()


@pytest.mark.long
@pytest.mark.parametrize("k", [10, 100])
def test_approximations_of_many_parts(k, monkeypatch):
    """Specks become single points on the coarsest level, whose energy is rounding alone."""
    mesh = disjoint_union(icosphere(5), *[moved(icosphere(0), 0.02, 3.0 + i) for i in range(3000)])
    laplacian = cotangent_laplacian(mesh)
    monkeypatch.setattr(approximate, "CERTIFIED_POINTS", 0)
    found = solve_spectrum(laplacian, k, method="approximate")
    exact = solve_spectrum(laplacian, k).eigenvalues
    np.testing.assert_allclose(found.eigenvalues, exact, atol=max(1e-3 * exact[-1], 1e-9))
