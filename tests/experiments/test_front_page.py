"""The front page and the docs show the figures of the experiments that they name."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
README = " ".join((ROOT / "README.md").read_text().split())


def full(name):
    return json.loads((ROOT / "experiments" / name).read_text())["full"]


def test_losses_of_changed_queries():
    rates = full("ch5_retrieval/expected_robustness.json")["rates"]
    noise, half, double, scanner = (
        round(rates[change]["outward, denoised"]["loss"][0])
        for change in ("noise .25", "half resolution", "double resolution", "scanner")
    )
    assert rates["flipped"]["outward, denoised"] == rates["clean"]["outward, denoised"]
    assert (
        f"costs {noise} points of that, half or double the resolution {half} and {double}, faces that look"
        in README
    )
    assert f"frame of a depth camera {scanner}." in README


def test_errors_of_parts():
    errors = {
        way: f"{100 * row['reporting']:.1f} %"
        for way, row in full("ch5_parts/expected.json")["error"].items()
    }
    assert f"disagree with people on {errors['default']} of pairs" in README
    cuts, means = (
        errors[f"{way}, as many as the default"] for way in ("normalized cut", "k-means")
    )
    assert (
        f"thesis preset {errors['thesis preset']}, normalized cuts {cuts}, k-means {means};"
        in README
    )


def test_bending_beside_as_rigid_as_possible():
    rows = full("ch6_deformation/expected.json").values()
    # Beside the better of two implementations.
    *most, last = sorted(
        row["graded"]["edges"] / min(row[peer]["edges"] for peer in ("ARAP", "ARAP (libigl)"))
        for row in rows
    )
    assert f"({most[0]:.2f} to {most[-1]:.2f} times in ten of eleven scenes, " in README
    assert f"{last:.1f} in one;" in README
    assert len(most) == 10
