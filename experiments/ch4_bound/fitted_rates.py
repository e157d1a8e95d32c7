"""Powers of closeness and heat time, from measurements."""

import numpy as np

import eigenshape as es


def bounding_rate(
    rate: es.stability.Rate, deltas: np.ndarray, times: np.ndarray, measured: np.ndarray
) -> es.stability.Rate:
    """Return the powers of a rate with the smallest constant that bounds all measurements from above."""
    powers = es.stability.Rate(rate.delta, rate.t)
    return es.stability.Rate(rate.delta, rate.t, float((measured / powers.at(deltas, times)).max()))


def fit_rate(deltas: np.ndarray, times: np.ndarray, measured: np.ndarray) -> es.stability.Rate:
    """Fit exponents and constant to measurements, by least squares of the logarithms.

    If all deltas or all times are equal, their exponent is 0.
    """
    columns = np.log(np.column_stack([deltas, times]))
    centered = columns - columns.mean(axis=0)
    varied = np.ptp(columns, axis=0) > 0
    if np.linalg.matrix_rank(centered[:, varied]) < np.count_nonzero(varied):
        raise ValueError("deltas and times must not vary together, to determine their exponents.")
    exponents = np.zeros(2)
    logs = np.log(measured)
    exponents[varied] = np.linalg.lstsq(centered[:, varied], logs - logs.mean(), rcond=None)[0]
    constant = float(np.exp(logs.mean() - columns.mean(axis=0) @ exponents))
    return es.stability.Rate(float(exponents[0]), float(exponents[1]), constant)
