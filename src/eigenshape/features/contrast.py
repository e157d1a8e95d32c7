"""The default cut of part trees, in a light module: the command line reads it for its help."""

# Least persistence of a part: the share of a temperature difference to its parent that is left
# after diffusion. A larger value finds fewer parts. The best of 0.1 to 0.4 on the tuning half of
# experiments/ch5_parts.
PART_CONTRAST = 0.3


def contrast_at(level: float) -> float:
    """Return the least persistence of a part at a level: half as much with each finer level."""
    return PART_CONTRAST * 0.5**level
