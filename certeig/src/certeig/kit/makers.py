"""What messages about a wrong type suggest; packages add their types when they are imported."""

# The call that makes a value of each type.
MAKERS = {"Generator": "numpy.random.default_rng(0)", "Mapping": "{title: value}"}
# The call that reads a value of each type from a file, for {path}.
READERS: dict[str, str] = {}
# The call that makes a value of one type from a value of another, if it is not the one in MAKERS.
CONVERSIONS: dict[tuple[str, str], str] = {}
