"""The default cut of part trees, in a light module: the command line reads it for its help."""

# Least persistence of a part. A larger value finds fewer parts. `part_contrast.LOG_CONTRAST` was
# chosen for this value on the tuning half of experiments/ch5_parts.
PART_CONTRAST = 0.3
# Least persistence of `part_tree` of the parts whose boundaries, creases and thickness are
# measured. They are few enough to be measured, and hardly a part that people see is lost.
FINE_CONTRAST = 0.15


def contrast_at(level: float) -> float:
    """Return the least persistence of a part at a level: half as much with each finer level."""
    return PART_CONTRAST * 0.5**level
