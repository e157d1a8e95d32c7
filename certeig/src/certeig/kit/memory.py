"""How much memory the machine has, and an error before work starts that would need more."""

import os
from collections.abc import Mapping

from certeig.kit.errors import CerteigError, InvalidParameterError

SHARE_OF_MEMORY = 0.9  # of the machine's memory; the rest is left to the operating system


def machine_memory() -> float:
    """Return the bytes of memory of this machine; 8 GiB where it does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return 8 * 2.0**30


def available_memory(share: float) -> float:
    """Return the bytes that a task may take, as a share of the memory of the machine."""
    return share * machine_memory()


def require_memory(
    what: str,
    task: str,
    sizes: Mapping[str, float],
    advice: str = "",
    *,
    share: float = SHARE_OF_MEMORY,
    error: type[CerteigError] = InvalidParameterError,
) -> None:
    """Raise an error if a task would need more than its share of the memory.

    Parameters
    ----------
    what : str
        What must fit into memory, such as "A spectrum".
    task : str
        How much is requested, such as "300 pairs of 5000 points".
    sizes : mapping
        Bytes, by the name of what takes them.
    advice : str
        A remedy, as a sentence.
    share : float
        Largest share of the memory of the machine.
    error : type
        Class of the error.
    """
    available = available_memory(share)
    if sum(sizes.values()) > available:
        listed = ", ".join(f"{size / 2**30:.1f} GiB of {name}" for name, size in sizes.items())
        raise error(
            f"{what} must fit into {100 * share:.0f} % of the memory, {available / 2**30:.1f} GiB; "
            f"for {task} that is about {listed}. {advice}".rstrip()
        )
