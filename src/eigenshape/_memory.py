"""How much memory the machine has, and an error before work starts that would need more."""

import os

from eigenshape._errors import InvalidParameterError

SHARE_OF_MEMORY = 0.9  # of the machine's memory; the rest is left to the operating system


def machine_memory() -> float:
    """Return the bytes of memory of this machine; 8 GiB where it does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return 8 * 2.0**30


def require_memory(what: str, sizes: dict[str, int], advice: str) -> None:
    """Raise an error if a spectrum would need more memory than the machine has.

    Parameters
    ----------
    what : str
        What is computed, such as "300 pairs of 5000 points".
    sizes : dict
        Bytes, by the name of what takes them.
    advice : str
        A remedy, without its full stop.

    Raises
    ------
    InvalidParameterError
        With the size of each part.
    """
    available = SHARE_OF_MEMORY * machine_memory()
    if sum(sizes.values()) > available:
        listed = ", ".join(f"{name} {size / 2**30:.1f} GiB" for name, size in sizes.items())
        raise InvalidParameterError(
            f"A spectrum must fit into memory, {available / 2**30:.1f} GiB; {what} take about {listed}. {advice}."
        )
