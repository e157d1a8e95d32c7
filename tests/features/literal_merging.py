"""Region merging as the thesis tells it (5.2.2): one region a triangle, the least persistent merged first."""

import heapq

import numpy as np


class LiteralMerging:
    """Regions with their faces, border edges, central triangle and pair edge, merged one at a time."""

    def __init__(self, faces, values):
        n = len(values)
        order = sorted(range(n), key=lambda v: (values[v], v))
        self.rank = {v: r for r, v in enumerate(order)}
        self.values = values
        self.keys = [tuple(sorted((self.rank[v] for v in face), reverse=True)) for face in faces]
        self.vertex = order
        sides = {}
        for face, corners in enumerate(faces):
            for a, b in ((0, 1), (1, 2), (2, 0)):
                key = tuple(sorted((self.rank[corners[a]], self.rank[corners[b]]), reverse=True))
                sides.setdefault(key, []).append(face)
        self.sides = {key: at for key, at in sides.items() if len(at) == 2}
        self.region = list(range(len(faces)))
        self.members = {face: [face] for face in range(len(faces))}
        self.border = {face: set() for face in range(len(faces))}
        for key, at in self.sides.items():
            for face in at:
                self.border[face].add(key)
        self.central = {face: face for face in range(len(faces))}
        self.pairs = []

    def value(self, key):
        return self.values[self.vertex[key[0]]]

    def persistence(self, region):
        if not self.border[region]:
            return np.inf
        return self.value(self.keys[self.central[region]]) - self.value(max(self.border[region]))

    def run(self, stop):
        """Merge until `stop(n_regions, persistence of the next)` says so."""
        queue = [(self.persistence(r), self.keys[self.central[r]], r) for r in self.members]
        heapq.heapify(queue)
        while queue:
            persistence, key, region = heapq.heappop(queue)
            alive = region in self.members and key == self.keys[self.central[region]]
            if not alive or persistence != self.persistence(region):
                continue
            if stop(len(self.members), persistence):
                break
            self._merge(region)
            kept = self.merged_into
            heapq.heappush(queue, (self.persistence(kept), self.keys[self.central[kept]], kept))
        return self

    def _merge(self, region):
        edge = max(self.border[region])
        other = next(self.region[face] for face in self.sides[edge] if self.region[face] != region)
        assert self.keys[self.central[other]] > self.keys[self.central[region]]
        self.pairs.append(
            (
                self.vertex[self.keys[self.central[region]][0]],
                self.vertex[edge[0]],
                self.vertex[edge[1]],
            )
        )
        for face in self.members.pop(region):
            self.region[face] = other
            self.members[other].append(face)
        self.border[other] ^= self.border.pop(region)
        self.merged_into = other

    def labels(self):
        """For each face, the vertex that is the maximum of its region."""
        return np.array([self.vertex[self.keys[self.central[region]][0]] for region in self.region])
