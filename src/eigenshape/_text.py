"""Text from outside: names of files, labels, what a foreign index says."""


def printable(text: str) -> str:
    r"""Return text with what is not printable spelled out, as ``\x1b`` for the escape character.

    Control characters steer terminals and break SVG, and those that turn the direction of writing
    disguise names. Letters of any script stay as they are.

    Examples
    --------
    >>> print(printable("a\x1b[31mb\nc"))
    a\x1b[31mb\nc
    """
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)
