"""What messages of the solver say beyond the rule and the fact: names, units and remedies."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Advice:
    """The names of matrices and rows, the unit of eigenvalues, and the remedies of messages, as sentences.

    A package that knows where matrices come from gives its own.

    Attributes
    ----------
    stiffness, mass : str
        Names of W and B.
    row : str
        What a row of both stands for.
    unit : str
        Unit of the eigenvalues; empty if they have none.
    scales : str
        If rows of very different scales cannot be solved together.
    separate : str
        If these rows are in parts that nothing connects.
    pieces : str
        If there are as many parts as requested pairs; {n} stands for their number.
    memory : str
        If the memory is too small.
    rounding : str
        If rounding of a factor is too large.
    inaccurate : str
        If pairs do not satisfy the equation well.
    slow : str
        If the iteration does not converge.
    """

    stiffness: str = "W"
    mass: str = "B"
    row: str = "row"
    unit: str = ""
    scales: str = (
        "Scale the unknowns so that the ratios W_ii/B_ii are closer, or fix those at fault."
    )
    separate: str = (
        "The rows with the smallest and the largest W_ii/B_ii are in parts that no entry connects. Solve "
        "the parts one by one."
    )
    pieces: str = (
        "The matrices have {n} parts that no entry connects, each of which has a lowest eigenvalue. "
        "Solve the parts one by one."
    )
    memory: str = "Request fewer pairs."
    rounding: str = "Rows whose W_ii/B_ii is far above that of others do this."
    inaccurate: str = "Rows whose W_ii/B_ii is far above that of others do this."
    slow: str = "Request fewer pairs."

    @property
    def units(self) -> str:
        """The unit in parentheses, after a space, or nothing."""
        return f" ({self.unit})" if self.unit else ""
