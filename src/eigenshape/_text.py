"""Text from outside, such as names of files and labels, made safe to print."""


def printable(text: str) -> str:
    r"""Return text with characters that are not printable as escapes, such as ``\x1b``.

    Control characters change the state of terminals and are not allowed in SVG, and those that
    reverse the direction of writing disguise names. Letters of any script do not change.

    Examples
    --------
    >>> print(printable("a\x1b[31mb\nc"))
    a\x1b[31mb\nc
    """
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def literal(text: str) -> str:
    r"""Return text that a figure shows letter by letter, such as a file's name: no ``$`` begins a formula.

    Examples
    --------
    >>> print(literal("a$b$.ply"))
    a\$b\$.ply
    """
    return printable(text).replace("$", r"\$")
