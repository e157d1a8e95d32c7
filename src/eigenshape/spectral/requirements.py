"""Checks of spectra for the functions that need them."""

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from eigenshape.spectral.spectrum import Spectrum


def require_lowest(spectrum: Spectrum, name: str) -> None:
    """Raise an error for what is no spectrum, or does not begin with the lowest eigenvalue."""
    require_type(spectrum, Spectrum, name)
    if spectrum.certificate.first:
        raise InvalidParameterError(
            f"{name} must begin with the lowest eigenvalue; it begins with number "
            f"{spectrum.certificate.first}. Use solve_spectrum without above."
        )
