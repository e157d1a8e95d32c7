"""What experiments on topological noise measure: spectra of samples of M and N, independent or coupled (thesis 4.4)."""

import warnings
from collections.abc import Iterator

import numpy as np
import scipy.linalg as sl
from rich.progress import track
from surgery import Surgery, widened

import eigenshape as es

N_DENSE = 2500  # points up to which a dense solve is the quicker one
WIDTHS = (
    0.01,
    0.02,
    0.04,
    0.06,
    0.08,
    0.1,
    0.15,
    0.2,
    0.3,
)  # of sqrt(area): by how much a region is tried wider


def eigenvalues(points: np.ndarray, t: float, k: int, volume: float) -> np.ndarray:
    """Return t vol(M) λ_i of the Gaussian-weighted graph Laplacian, i = 1..k: without unit, 1 where Δ is at its end.

    Eigenvalues of the graph Laplacian are those of (1 - exp(-tΔ))/(t vol), so that these lie between 0 and about 1.
    """
    laplacian = es.operators.gaussian_laplacian(points, t, 2)
    n = laplacian.n_points
    if n <= N_DENSE:
        values = sl.eigh(
            n * laplacian.stiffness.toarray(), eigvals_only=True, subset_by_index=[0, k - 1]
        )
    else:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", UserWarning
            )  # that the last ones say little of the shape: known, and told
            values = es.solve_spectrum(laplacian, k).eigenvalues
    return t * volume * values


def coupled_points(
    surgery: Surgery, n: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Throw n points on M and n on N, each uniformly, so that as many as can be are the same.

    A point outside the regions stays, one in X_i is thrown anew on Y_i; as many more as N has area there, by chance,
    are taken from where it has less (a maximal coupling of the regions). For surfaces equal outside the regions.
    """
    on_one = es.geometry.sample_surface(surgery.one, n, rng=rng)
    numbers = np.arange(-1, max(surgery.regions_one.max(), surgery.regions_two.max()) + 1)
    share_one, share_two = (_region_shares(*side, numbers) for side in _sides(surgery))
    place = surgery.regions_one[on_one.simplices] + 1
    leaves = rng.random(n) * share_one[place] > share_two[place]
    excess = np.maximum(share_two - share_one, 0)
    if leaves.any():
        place[leaves] = rng.choice(len(numbers), leaves.sum(), p=excess / excess.sum())
    points = on_one.points.copy()
    for number in numbers:
        new = (place == number + 1) & (leaves if number < 0 else True)
        if new.any():
            points[new] = _throw(surgery.two, surgery.regions_two == number, int(new.sum()), rng)
    return on_one.points, points


def _sides(surgery: Surgery) -> tuple[tuple[es.TriangleMesh, np.ndarray], ...]:
    return (surgery.one, surgery.regions_one), (surgery.two, surgery.regions_two)


def _region_shares(mesh: es.TriangleMesh, regions: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    areas = es.geometry.face_areas(mesh)
    return np.array([areas[regions == number].sum() for number in numbers]) / areas.sum()


def _throw(
    mesh: es.TriangleMesh, faces: np.ndarray, n: int, rng: np.random.Generator
) -> np.ndarray:
    return es.geometry.sample_surface(
        es.TriangleMesh(mesh.vertices, mesh.faces[faces]), n, rng=rng
    ).points


def changes(before: np.ndarray, after: np.ndarray) -> dict[str, float]:
    """Return mean and largest |λ_i(P) - λ_i(Q)|, as given and of the largest λ(P)."""
    found = np.abs(after - before)
    last = before[-1]
    return {
        "mean": found.mean(),
        "largest": found.max(),
        "largest/λ": found.max() / last,
        "mean/λ": found.mean() / last,
    }


def summary(rows: list[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Return mean, least and most over seeds of each measure."""
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    return {
        key: {"mean": x.mean(), "least": x.min(), "most": x.max()} for key, x in columns.items()
    }


def measure(
    surgeries: dict[str, Surgery],
    t: float,
    n: int,
    *,
    k: int = 300,
    seeds: int = 5,
    form: str = "coupled",
) -> dict:
    """Measure how the spectra of samples change from M to each N: "coupled", or "independent" with its floor.

    The floor, named "M again", is what two samples of M differ by. Also gives the spectra of the first seed.
    """
    kept: dict[str, list] = {}
    spectra: dict[str, np.ndarray] = {}
    for seed in range(seeds):
        for name, found in _one_seed(surgeries, t, n, k, np.random.default_rng([seed, n]), form):
            if name == "M":
                first = found
            else:
                kept.setdefault(name, []).append(changes(first, found))
            spectra.setdefault(name, found)
    return {"changes": {name: summary(rows) for name, rows in kept.items()}, "spectra": spectra}


def _one_seed(
    surgeries: dict[str, Surgery], t: float, n: int, k: int, rng: np.random.Generator, form: str
) -> Iterator[tuple[str, np.ndarray]]:
    start = int(rng.integers(2**31))
    one = next(iter(surgeries.values())).one
    volume = es.geometry.surface_area(one)
    samples = {"M": es.geometry.sample_surface(one, n, rng=np.random.default_rng(start)).points}
    if form == "independent":
        samples["M again"] = es.geometry.sample_surface(one, n, rng=rng).points
    for name, surgery in surgeries.items():
        if form == "independent":
            samples[name] = es.geometry.sample_surface(surgery.two, n, rng=rng).points
        else:
            samples[name] = coupled_points(surgery, n, np.random.default_rng(start))[1]
    for name, points in samples.items():
        yield name, eigenvalues(points, t, k, volume)


def mesh_spectra(
    surgeries: dict[str, Surgery], k: int = 100, *, kernel: bool = True
) -> dict[str, dict[str, np.ndarray]]:
    """Return vol(M) λ_i of operators on the meshes of M and each N, i = 1..k: cotangent, and kernel with t = e² of M.

    The mesh Laplacian is solved once: its corrected eigenvalues are -log(1 - t μ)/t of the literal ones μ.
    """
    one = next(iter(surgeries.values())).one
    volume, t = es.geometry.surface_area(one), float(np.mean(es.geometry.edge_lengths(one))) ** 2
    names = ("cotangent", "mesh, literal", "mesh, corrected") if kernel else ("cotangent",)
    found: dict[str, dict[str, np.ndarray]] = {name: {} for name in names}
    for name, mesh in {
        "M": one,
        **{name: surgery.two for name, surgery in surgeries.items()},
    }.items():
        found["cotangent"][name] = (
            volume * es.solve_spectrum(es.cotangent_laplacian(mesh), k).eigenvalues
        )
        if not kernel:
            continue
        values = es.solve_spectrum(es.mesh_laplacian(mesh, t=t), k).eigenvalues
        found["mesh, literal"][name] = volume * values
        found["mesh, corrected"][name] = -volume * np.log1p(-t * values) / t
    return found


def mesh_changes(
    spectra: dict[str, dict[str, np.ndarray]],
) -> dict[str, dict[str, dict[str, float]]]:
    """Return for each operator and each N the second eigenvalue, and the changes from M over the last one of M."""
    table = {}
    for operator, rows in spectra.items():
        before = rows["M"]
        table[operator] = {
            name: {
                "λ_2": after[1],
                **{key: x for key, x in changes(before, after).items() if "/" in key},
            }
            for name, after in rows.items()
        }
    return table


def soundness(
    surgery: Surgery, *, close: bool = True, widen: bool = True
) -> dict[str, float | str]:
    """Return what is to be known of N: topology, crossing faces, areas inside the regions, how close it is to M."""
    two = surgery.two
    inside = [es.geometry.face_areas(mesh)[regions >= 0].sum() for mesh, regions in _sides(surgery)]
    return {
        "closed manifold": es.geometry.is_closed(two) and es.geometry.is_manifold(two),
        "Euler characteristic": es.geometry.euler_characteristic(two),
        "components": es.geometry.vertex_components(two)[0],
        "crossing faces": len(es.geometry.self_intersections(two)),
        "area of X": inside[0],
        "area of Y": inside[1],
        "area of M": es.geometry.surface_area(surgery.one),
        **(closeness(surgery, widen=widen) if close else {}),
    }


def closeness(surgery: Surgery, *, widen: bool = True) -> dict[str, float | str]:
    """Return for which δ the surfaces are δ-close, with the regions as they are and, if one, with the best wider one.

    What the region gains in area counts by its share of the region (condition C2): a wider region takes a larger ball,
    and gains less of itself.
    """
    widths = [0.0]
    if widen and surgery.regions_one.max() == 0:
        widths += [width * es.geometry.surface_area(surgery.one) ** 0.5 for width in WIDTHS]
    found = [_delta(surgery, width) for width in widths[:1]]
    for width in widths[1:]:
        if found[-1].limited_by == "ball":  # which a wider region only takes a larger one of
            break
        found.append(_delta(surgery, width))
    best = min(range(len(found)), key=lambda place: found[place].delta)
    return {
        "δ": found[0].delta,
        "limited by": found[0].limited_by,
        "least δ": found[best].delta,
        "widened by": widths[best],
        "displacement": found[0].displacement.max(initial=0.0),
    }


def _delta(surgery: Surgery, width: float) -> es.stability.Closeness:
    one = widened(surgery, width) if width else surgery
    pair = es.stability.measure_perturbation(
        one.one, one.two, regions_one=one.regions_one, regions_two=one.regions_two
    )
    return es.stability.measure_closeness(pair)


def sample_all(
    surgeries: dict[str, Surgery], runs: tuple[tuple[float, str, int, int], ...], k: int
) -> dict[str, dict]:
    """Measure at each heat time, form, number of points and of seeds."""
    return {
        f"t = {t:g}, n = {n}, {form}": measure(surgeries, t, n, k=k, seeds=seeds, form=form)
        for t, form, n, seeds in track(runs, description="samples")
    }
