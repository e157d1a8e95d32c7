"""Faces as a short string of symbols: a walk over the mesh from face to face."""

from collections import deque

import numpy as np
from jaxtyping import Int

from certeig.kit.errors import FileFormatError

# What lies beyond an open side: nothing, a face with a new vertex, or a face whose third vertex is
# the start of the open side that ends here, or the end of the one that begins here.
NOTHING, NEW, PREVIOUS, NEXT = range(4)
# Any other vertex that the walk has seen, as where two fronts meet; its number is a reference.
OTHER = 4


class Front:
    """The sides that a walk has seen from one face only, and the order in which they wait.

    Writer and reader hold one each and treat them alike, so that both know the same neighbors.
    """

    def __init__(self) -> None:
        self.waiting: deque[tuple[int, int]] = deque()
        self._open: set[tuple[int, int]] = set()
        self._heads: dict[int, list[int]] = {}
        self._tails: dict[int, list[int]] = {}

    def add_face(self, face: tuple[int, int, int]) -> None:
        """Close the open sides on which a face lies, and open its other sides."""
        a, b, c = face
        for tail, head in ((a, b), (b, c), (c, a)):
            if (head, tail) in self._open:
                self.close(head, tail)
            elif (tail, head) not in self._open:
                self._open.add((tail, head))
                self._heads.setdefault(tail, []).append(head)
                self._tails.setdefault(head, []).append(tail)
                self.waiting.append((tail, head))

    def close(self, tail: int, head: int) -> None:
        """Take a side off the front."""
        self._open.discard((tail, head))
        self._heads[tail].remove(head)
        self._tails[head].remove(tail)

    def take(self) -> tuple[int, int] | None:
        """Return the open side that was seen last, or None if no side is open."""
        while self.waiting:
            side = self.waiting.pop()
            if side in self._open:
                return side
        return None

    def previous(self, tail: int) -> int:
        """Return the start of the open side that ends at a vertex, or -1."""
        tails = self._tails.get(tail)
        return tails[-1] if tails else -1

    def next(self, head: int) -> int:
        """Return the end of the open side that begins at a vertex, or -1."""
        heads = self._heads.get(head)
        return heads[-1] if heads else -1


def write_faces(
    faces: Int[np.ndarray, "f 3"], n_vertices: int
) -> tuple[bytes, list[int], Int[np.ndarray, " n"], Int[np.ndarray, "f 3"]]:
    """Walk over all faces, and return what a reader needs to walk the same way.

    Each face is entered through an open side, in the spirit of Edgebreaker (Rossignac 1999), but
    the front is one set of sides whatever the topology, and what it does not foresee is an explicit
    reference. So any list of faces can be written: with boundaries, handles, non-manifold edges,
    neighbors of opposite orientation, repeated faces or corners.

    Returns
    -------
    symbols : bytes
        One for each open side that the walk takes, and three for each face at which it starts.
    references : list of int
        For each symbol OTHER, how many vertices before the newest one is meant.
    vertex_order : (n,) int
        The given number of each vertex, in the order of the walk. Vertices without faces are last.
    walked : (f, 3) int
        The faces in the order of the walk, by the new numbers.
    """
    beyond: dict[tuple[int, int], list[int]] = {}
    rows = faces.tolist()
    for index in range(len(rows) - 1, -1, -1):  # so that pop() gives the lowest number
        a, b, c = rows[index]
        for edge in {(a, b), (b, c), (c, a)}:
            beyond.setdefault(edge, []).append(index)

    front, symbols, references = Front(), bytearray(), []
    number = [-1] * n_vertices
    order: list[int] = []
    walked: list[tuple[int, int, int]] = []
    is_done = bytearray(len(rows))

    def write_vertex(vertex: int) -> int:
        if number[vertex] < 0:
            symbols.append(NEW)
            number[vertex] = len(order)
            order.append(vertex)
        else:
            symbols.append(OTHER)
            references.append(len(order) - 1 - number[vertex])
        return number[vertex]

    start = 0
    while len(walked) < len(rows):
        side = front.take()
        if side is None:
            while is_done[start]:
                start += 1
            a, b, c = (write_vertex(corner) for corner in rows[start])
            face, index = (a, b, c), start
        else:
            tail, head = side
            candidates = beyond.get((order[head], order[tail]), [])
            while candidates and is_done[candidates[-1]]:
                candidates.pop()
            if not candidates:
                symbols.append(NOTHING)
                front.close(tail, head)
                continue
            index = candidates[-1]
            third = _third_corner(rows[index], order[head], order[tail])
            known = number[third]
            if known >= 0 and known == front.previous(tail):
                symbols.append(PREVIOUS)
            elif known >= 0 and known == front.next(head):
                symbols.append(NEXT)
            else:
                known = write_vertex(third)
            face = (head, tail, known)
        is_done[index] = 1
        front.add_face(face)
        walked.append(face)

    loose = np.flatnonzero(np.array(number, dtype=np.int64) < 0)
    vertex_order = np.concatenate([np.array(order, dtype=np.int64), loose])
    return bytes(symbols), references, vertex_order, np.array(walked, np.int64).reshape(-1, 3)


def _third_corner(row: list[int], tail: int, head: int) -> int:
    """Return the corner of a face that is not on its side from `tail` to `head`."""
    sides = zip(row, row[1:] + row[:1], strict=True)
    return row[(list(sides).index((tail, head)) + 2) % 3]


def read_faces(
    symbols: bytes, references: list[int], n_faces: int, n_vertices: int
) -> Int[np.ndarray, "f 3"]:
    """Walk over faces as `write_faces` did.

    Raise FileFormatError if symbols or references end early or are left over, a symbol is unknown
    or leads to no vertex, or there are more vertices than `n_vertices`.
    """
    front = Front()
    coming, pointing = iter(symbols), iter(references)
    walked: list[tuple[int, int, int]] = []
    n_seen = 0

    def read_vertex(symbol: int, tail: int, head: int) -> int:
        nonlocal n_seen
        if symbol == NEW:
            n_seen += 1
            return n_seen - 1
        if symbol == OTHER:
            return n_seen - 1 - next(pointing)
        return {PREVIOUS: front.previous(tail), NEXT: front.next(head)}.get(symbol, -1)

    try:
        while len(walked) < n_faces:
            side = front.take()
            if side is None:
                # a list, because a generator would turn the end of the symbols into another error
                a, b, c = [read_vertex(next(coming), -1, -1) for _ in range(3)]
                face = (a, b, c)
            else:
                tail, head = side
                symbol = next(coming)
                if symbol == NOTHING:
                    front.close(tail, head)
                    continue
                face = (head, tail, read_vertex(symbol, tail, head))
            if min(face) < 0 or n_seen > n_vertices:
                raise FileFormatError(
                    f"A compressed mesh must name vertices 0..{n_vertices - 1} that came before; "
                    f"face {len(walked)} is {list(face)}. The file is damaged."
                )
            front.add_face(face)
            walked.append(face)
    except StopIteration as err:
        raise FileFormatError(
            f"A compressed mesh must have a symbol for each of its {n_faces} faces; the symbols "
            f"end at face {len(walked)}. The file is damaged."
        ) from err
    if next(coming, None) is not None or next(pointing, None) is not None:
        raise FileFormatError(
            f"A compressed mesh must end with its {n_faces} faces; symbols are left over. The file "
            "is damaged."
        )
    return np.array(walked, dtype=np.int64).reshape(-1, 3)
