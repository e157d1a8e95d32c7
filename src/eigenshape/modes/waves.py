"""Activity that spreads as damped waves, and the blood signal that follows it, mode by mode."""

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, real_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import MOST_STEPS, require_finite_rows
from eigenshape.spectral.spectrum import Spectrum

# Of the balloon model (Friston and others 2000; Pang and others 2023): decay of the signal in 1/s,
# feedback of the flow in 1/s², transit time in s, exponent of the outflow, share of oxygen extracted
# at rest, and the coefficients of the signal.
DECAY, FLOW, TRANSIT, STIFFNESS, EXTRACTED = 0.65, 0.41, 0.98, 0.32, 0.34
VOLUME, K1, K2, K3 = 0.02, 3.72, 0.527, 0.48
LONGEST_STEP = 0.05  # s, of the nonlinear model: errors are below 1e-6 of the signal


@one_blas_thread()
def wave_response(
    drive: ArrayLike,
    spectrum: Spectrum,
    dt: float,
    *,
    length_scale: float = 17.4,
    damping: float = 116.0,
) -> Float[np.ndarray, "k times"]:
    """Simulate activity that spreads as damped waves, such as in a neural field.

    (1/γ² ∂²/∂t² + 2/γ ∂/∂t + 1 - r²Δ) φ = Q (Robinson, Rennie and Wright 1997; Pang and others
    2023). Mode j with eigenvalue λ is an oscillator of its own, φ'' + 2γ φ' + γ²(1 + r²λ) φ = γ² q,
    at rest at the first time. It is solved exactly for a drive that is linear between times.

    Parameters
    ----------
    drive : (j, times) float
        Coefficients of the input Q in the first j modes, from `es.spectral.project`.
    spectrum : Spectrum
        k ≥ j eigenpairs.
    dt : float
        Between two times, in s.
    length_scale : float
        r, in the unit of the coordinates: the default is that of a human cortex in mm.
    damping : float
        γ, in 1/s. Waves travel at r γ: 2 m/s by default.

    Returns
    -------
    (j, times) float
        Coefficients of the activity; `es.spectral.reconstruct` makes maps of them.

    Raises
    ------
    InvalidParameterError
        If the drive is no table of finite numbers with at most one row per mode, a parameter is not
        positive, or floats cannot represent the response.

    See Also
    --------
    blood_response : The blood signal of activity.

    Examples
    --------
    A constant drive of mode j ends at 1 / (1 + r²λ):

    >>> import numpy as np, eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 4)
    >>> found = es.modes.wave_response(np.ones((4, 2000)), spectrum, 1e-3, length_scale=1.0)
    >>> found[:, -1].round(2).tolist()  # the eigenvalues are 0, 2, 2, 2
    [1.0, 0.33, 0.33, 0.33]
    """
    require_type(spectrum, Spectrum, "spectrum")
    inputs = _time_series(drive, "drive", len(spectrum.eigenvalues))
    scale, rate = positive_values([length_scale, damping], "length_scale and damping")
    # In units of 1/γ for time, so that velocities are of the size of values.
    with np.errstate(over="ignore"):
        stretch = 1 + scale**2 * spectrum.eigenvalues[: len(inputs)]
    system = np.zeros((len(inputs), 2, 2))
    system[:, 0, 1] = 1.0
    system[:, 1, 0] = -stretch
    system[:, 1, 1] = -2.0
    (step,) = positive_values(dt, "dt")
    return _respond(rate * system, rate * np.array([0.0, 1.0]), inputs, step)[:, 0]


@one_blas_thread()
def blood_response(
    activity: ArrayLike, dt: float, *, linear: bool = True
) -> Float[np.ndarray, "rows times"]:
    """Compute the blood-oxygen signal of activity by the balloon model.

    With flow f, volume v and deoxyhemoglobin q, which are 1 at rest (Buxton, Wong and Frank 1998;
    Friston and others 2000; Stephan and others 2007): f'' + κ f' + γ (f - 1) = x, τ v' = f -
    v^(1/α), τ q' = f (1 - (1 - ρ)^(1/f)) / ρ - q v^(1/α - 1), and the signal V₀ (k₁ (1 - q) + k₂
    (1 - q/v) + k₃ (1 - v)). All is at rest at the first time, and activity is linear between times.

    By default the model is linear around rest, where it is solved exactly, and may be taken of maps
    or of their coefficients. The nonlinear one saturates, and is of maps alone: the signal of a sum
    is not the sum of signals.

    Parameters
    ----------
    activity : (rows, times) float
        One row per mode or point, such as from `wave_response`.
    dt : float
        Between two times, in s.
    linear : bool
        Whether the model is linear around rest.

    Returns
    -------
    (rows, times) float
        Change of the signal as a share of the signal at rest.

    Raises
    ------
    InvalidParameterError
        If the activity is no table of finite numbers, dt is not positive, floats cannot represent the
        signal, or of the nonlinear model dt is above 50,000 s, or flow or volume fall to 0.

    Examples
    --------
    After a second of activity the signal is largest at 3.8 s, and undershoots later:

    >>> import numpy as np, eigenshape as es
    >>> activity = np.zeros((1, 300))
    >>> activity[0, :10] = 1.0
    >>> signal = es.modes.blood_response(activity, 0.1)[0]
    >>> signal.argmax().item(), signal.argmin().item()  # in tenths of a second
    (38, 98)
    """
    inputs = _time_series(activity, "activity")
    (step,) = positive_values(dt, "dt")
    if not linear:
        return _balloon(inputs, step)
    rest = 1 + (1 - EXTRACTED) * np.log(1 - EXTRACTED) / EXTRACTED
    outflow = 1 / STIFFNESS
    system = np.array(
        [  # signal, flow, volume, deoxyhemoglobin
            [-DECAY, -FLOW, 0.0, 0.0],
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1 / TRANSIT, -outflow / TRANSIT, 0.0],
            [0.0, rest / TRANSIT, -(outflow - 1) / TRANSIT, -1 / TRANSIT],
        ]
    )
    states = _respond(system[None], np.array([1.0, 0.0, 0.0, 0.0]), inputs, step)
    return VOLUME * ((K2 - K3) * states[:, 2] - (K1 + K2) * states[:, 3])


def _balloon(inputs: Float[np.ndarray, "rows times"], dt: float) -> Float[np.ndarray, "rows times"]:
    """Solve the nonlinear model from rest, by steps of Runge and Kutta of order 4."""
    if dt > MOST_STEPS * LONGEST_STEP:
        raise InvalidParameterError(
            f"dt must be at most {MOST_STEPS * LONGEST_STEP:g} s in the nonlinear model, which takes "
            f"steps of {LONGEST_STEP} s; it is {dt:g}. Give a shorter dt, or linear=True."
        )
    n_steps = int(np.ceil(dt / LONGEST_STEP))
    h = dt / n_steps
    state = np.ones((4, len(inputs)))  # change of flow, flow, volume, deoxyhemoglobin
    state[0] = 0.0
    signal = np.zeros(inputs.shape)

    def slope(state: np.ndarray, drive: np.ndarray) -> np.ndarray:
        change, flow, volume, held = state
        extracted = flow * (1 - (1 - EXTRACTED) ** (1 / flow)) / EXTRACTED
        outflow = volume ** (1 / STIFFNESS)
        return np.array(
            [
                drive - DECAY * change - FLOW * (flow - 1),
                change,
                (flow - outflow) / TRANSIT,
                (extracted - held * outflow / volume) / TRANSIT,
            ]
        )

    for time in range(1, inputs.shape[1]):
        before, rise = inputs[:, time - 1], (inputs[:, time] - inputs[:, time - 1]) / n_steps
        for number in range(n_steps):
            start, middle, end = (before + (number + share) * rise for share in (0, 0.5, 1))
            with np.errstate(all="ignore"):
                one = slope(state, start)
                two = slope(state + h / 2 * one, middle)
                three = slope(state + h / 2 * two, middle)
                four = slope(state + h * three, end)
                state = state + h / 6 * (one + 2 * two + 2 * three + four)
        low = np.flatnonzero(~(state[1:3] > 0).all(axis=0) | ~np.isfinite(state).all(axis=0))
        if low.size:
            raise InvalidParameterError(
                "Flow and volume of the balloon model must stay above 0; those of row "
                f"{low[0]} do not, at time {time}, with an activity of {inputs[low[0], time]:g}. "
                "Give less activity, or linear=True."
            )
        _, _, volume, held = state
        signal[:, time] = VOLUME * (K1 * (1 - held) + K2 * (1 - held / volume) + K3 * (1 - volume))
    return signal


def _time_series(
    values: ArrayLike, name: str, most: int | None = None
) -> Float[np.ndarray, "rows times"]:
    series = real_numbers(values, name).astype(np.float64)
    if series.ndim != 2 or not series.size or (most is not None and len(series) > most):
        rows = "one row per mode or point" if most is None else f"one row per mode, 1 to {most}"
        raise InvalidParameterError(
            f"{name} must have {rows}, and one column per time; the shape is {series.shape}."
        )
    require_finite_rows(series, name, "row")
    return series


def _respond(
    system: Float[np.ndarray, "systems m m"],
    entry: Float[np.ndarray, " m"],
    inputs: Float[np.ndarray, "rows times"],
    step: float,
) -> Float[np.ndarray, "rows m times"]:
    """Solve y' = A y + b u from rest, exactly for u linear between times; one A for each row or all.

    The exponential of the triangular block matrix [[A, b, 0], [0, 0, 1], [0, 0, 0]] of a step holds
    the integrals over it (Van Loan 1978).
    """
    size = len(entry)
    joint = np.zeros((len(system), size + 2, size + 2))
    with np.errstate(over="ignore"):
        joint[:, :size, :size] = step * system
        joint[:, :size, size] = step * entry
    joint[:, size, size + 1] = 1.0
    power = np.broadcast_to(sl.expm(joint), (len(inputs), size + 2, size + 2))
    advance, constant, ramp = power[:, :size, :size], power[:, :size, size], power[:, :size, -1]
    before, changes = inputs.T[:-1, :, None], np.diff(inputs.T, axis=0)[:, :, None]
    # What the input adds in each step; the states follow in the same memory.
    states = np.concatenate(
        [np.zeros((1, len(inputs), size)), constant * before + ramp * changes], axis=0
    )
    for time in range(1, len(states)):
        states[time] += np.einsum("rij,rj->ri", advance, states[time - 1])
    # The exponential of a matrix above about 1e36 has no number that floats can represent.
    bad = np.argwhere(~np.isfinite(states))
    if len(bad):
        raise InvalidParameterError(
            f"The response must be finite; that of row {bad[0, 1]} at time {bad[0, 0]} is not, with dt = "
            f"{step:g} s and rates up to {np.abs(system).max():g} 1/s. Give a shorter dt, lower rates, or "
            "a smaller input."
        )
    return states.transpose(1, 2, 0)
