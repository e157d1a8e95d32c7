"""Body plans of the made-up creatures, as tables.

A creature faces +x, stands upright along +z, and its left is +y. A plan is a list of bones. Each begins where its
parent ends and swings about that place.
"""

from typing import NamedTuple

Number = int | float
Vector = tuple[Number, Number, Number]


class Bone(NamedTuple):
    """A round cone, and how far it may swing with all that hangs on it.

    name: a trailing * makes a mirrored pair, left and right; parent: name of the bone at whose end it begins, "" for
    the root at the origin; to: its end, seen from its beginning; radii: at both ends; swings: axis and least and most
    angle in degrees, as in (0, 1, 0, -30, 45). Turning about +y leans what points up towards +x.
    """

    name: str
    parent: str
    to: Vector
    radii: tuple[Number, Number]
    swings: tuple[tuple[Number, Number, Number, Number, Number], ...] = ()


def _chain(name: str, parent: str, steps: int, to: Vector, radii: tuple[Number, Number], *swings: Vector) -> list[Bone]:
    """Return a limb of equal bones that thins out; each swing is (which axis, least, most) at every joint."""
    axes = {0: (1.0, 0.0, 0.0), 1: (0.0, 1.0, 0.0), 2: (0.0, 0.0, 1.0)}
    along = [radii[0] + (radii[1] - radii[0]) * step / steps for step in range(steps + 1)]
    paired = "*" if name.endswith("*") else ""
    names = [f"{name.rstrip('*')}{step}{paired}" for step in range(steps)]
    turns = tuple((*axes[int(axis)], low, high) for axis, low, high in swings)
    return [
        Bone(names[step], names[step - 1] if step else parent, to, (along[step], along[step + 1]), turns)
        for step in range(steps)
    ]


def _legs(height: float, radius: float, foot: float = 0.12) -> list[Bone]:
    """Return the four legs of a beast between the bones `shoulders` and `hips`."""
    bones = []
    for name, parent, bend in (("fore", "shoulders", 1.0), ("hind", "hips", -1.0)):
        bones += [
            Bone(f"{name} root*", parent, (0, 0.14, -0.05), (0.9 * radius + 0.03, 1.3 * radius)),
            Bone(
                f"{name} upper*", f"{name} root*", (0, 0.03, -0.5 * height), (1.3 * radius, radius),
                ((0, 1, 0, -32, 32),),
            ),
            Bone(
                f"{name} lower*", f"{name} upper*", (0, 0, -0.45 * height), (radius, 0.75 * radius),
                ((0, 1, 0, 0, 45) if bend > 0 else (0, 1, 0, -45, 0),),
            ),
            Bone(f"{name} foot*", f"{name} lower*", (foot, 0, -0.02), (0.8 * radius, 0.7 * radius)),
        ]  # fmt: skip
    return bones


BIPED = [
    Bone("pelvis", "", (0, 0, 0.12), (0.15, 0.14)),
    Bone("chest", "pelvis", (0, 0, 0.38), (0.14, 0.17), ((0, 1, 0, -10, 30), (0, 0, 1, -25, 25))),
    Bone("neck", "chest", (0, 0, 0.2), (0.08, 0.07)),
    Bone("head", "neck", (0.02, 0, 0.16), (0.11, 0.13), ((0, 1, 0, -15, 25), (0, 0, 1, -30, 30))),
    Bone("shoulder*", "chest", (0, 0.21, 0.02), (0.1, 0.08)),
    Bone("arm*", "shoulder*", (0, 0.26, -0.13), (0.075, 0.06), ((1, 0, 0, -25, 45), (0, 1, 0, -50, 50))),
    Bone("forearm*", "arm*", (0, 0.24, -0.12), (0.06, 0.048), ((0, 0, 1, 0, 70),)),
    Bone("palm*", "forearm*", (0, 0.1, -0.05), (0.055, 0.045)),
    Bone("hip*", "pelvis", (0, 0.12, -0.16), (0.13, 0.11)),
    Bone("thigh*", "hip*", (0, 0.04, -0.4), (0.11, 0.075), ((0, 1, 0, -55, 20), (1, 0, 0, -5, 22))),
    Bone("shin*", "thigh*", (0, 0.02, -0.4), (0.075, 0.052), ((0, 1, 0, 0, 65),)),
    Bone("foot*", "shin*", (0.17, 0.01, -0.03), (0.055, 0.045)),
]

QUADRUPED = [
    Bone("hips", "", (-0.3, 0, 0.02), (0.19, 0.2)),
    Bone("shoulders", "", (0.32, 0, 0.02), (0.19, 0.19), ((0, 0, 1, -12, 12),)),
    Bone("neck", "shoulders", (0.24, 0, 0.3), (0.14, 0.1), ((0, 1, 0, -25, 45), (0, 0, 1, -30, 30))),
    Bone("head", "neck", (0.26, 0, -0.06), (0.1, 0.06), ((0, 1, 0, -15, 25),)),
    Bone("ear*", "neck", (-0.04, 0.1, 0.14), (0.055, 0.045)),
    *_legs(0.75, 0.075),
    *_chain("tail", "hips", 3, (-0.13, 0, -0.1), (0.065, 0.05), (1, -25, 10), (2, -20, 20)),
]

GIRAFFE = [
    Bone("hips", "", (-0.22, 0, -0.05), (0.17, 0.16)),
    Bone("shoulders", "", (0.22, 0, 0.06), (0.17, 0.17)),
    *_chain("neck", "shoulders", 4, (0.09, 0, 0.22), (0.11, 0.065), (1, -8, 16), (2, -10, 10), (0, -9, 9)),
    Bone("head", "neck3", (0.19, 0, -0.06), (0.075, 0.05), ((0, 1, 0, -15, 25),)),
    Bone("horn*", "neck3", (-0.03, 0.1, 0.13), (0.05, 0.045)),
    *_legs(1.05, 0.07, foot=0.08),
    *_chain("tail", "hips", 2, (-0.13, 0, -0.16), (0.055, 0.05), (1, -30, 5)),
]

OCTOPUS = [
    Bone("mantle", "", (-0.03, 0, 0.42), (0.24, 0.27), ((1, 0, 0, -12, 12), (0, 1, 0, -15, 15))),
    *(
        bone
        for arm, (x, y) in enumerate(((0.3, 0.125), (0.125, 0.3), (-0.125, 0.3), (-0.3, 0.125)))
        for bone in _chain(
            f"arm {arm} *", "", 5, (0.75 * x, 0.75 * y, -0.03), (0.085, 0.045), (0, -20, 20), (1, -20, 20), (2, -26, 26)
        )
    ),
]

HAND = [
    Bone("wrist", "", (0, 0, -0.3), (0.17, 0.16), ((0, 1, 0, -25, 25),)),
    Bone("palm", "", (0, 0, 0.26), (0.18, 0.2)),
    Bone("palm side*", "", (0, 0.16, 0.26), (0.13, 0.13)),
    *(
        bone
        for name, y, lean, length in (
            ("index", 0.25, 0.05, 0.15), ("middle", 0.085, 0.015, 0.17), ("ring", -0.085, -0.015, 0.16),
            ("little", -0.25, -0.05, 0.12),
        )
        for bone in (
            Bone(f"{name} root", "palm", (0, y, 0.1), (0.09, 0.075)),
            *_chain(name, f"{name} root", 3, (0, lean, length), (0.072, 0.055), (1, -5, 42)),
        )
    ),
    Bone("thumb root", "", (0.05, 0.26, 0.05), (0.12, 0.09)),
    *_chain("thumb", "thumb root", 2, (0.02, 0.15, 0.12), (0.085, 0.065), (0, -10, 28), (2, -15, 30)),
]  # fmt: skip

BIRD = [
    Bone("rump", "", (-0.26, 0, -0.02), (0.19, 0.11)),
    Bone("breast", "", (0.2, 0, 0.06), (0.19, 0.15)),
    Bone("neck", "breast", (0.16, 0, 0.12), (0.09, 0.075), ((0, 1, 0, -20, 20), (0, 0, 1, -30, 30))),
    Bone("head", "neck", (0.06, 0, 0.03), (0.1, 0.09)),
    Bone("beak", "head", (0.19, 0, -0.03), (0.06, 0.045)),
    Bone("wing root*", "", (0.06, 0.24, 0.09), (0.09, 0.075), ((1, 0, 0, -25, 35),)),
    Bone("wing*", "wing root*", (-0.02, 0.36, 0.03), (0.075, 0.06), ((1, 0, 0, -30, 35), (0, 0, 1, -20, 20))),
    Bone("wing tip*", "wing*", (-0.12, 0.36, 0.0), (0.06, 0.035), ((1, 0, 0, -35, 35), (0, 0, 1, -35, 10))),
    Bone("feathers*", "wing root*", (-0.24, 0.1, 0.0), (0.06, 0.04)),
    Bone("far feathers*", "wing*", (-0.24, 0.02, 0.0), (0.05, 0.035)),
    Bone("tail", "rump", (-0.3, 0, 0.02), (0.08, 0.05), ((0, 1, 0, -20, 20), (0, 0, 1, -20, 20))),
    Bone("tail fan*", "rump", (-0.27, 0.13, 0.02), (0.06, 0.04), ((0, 1, 0, -20, 20),)),
    Bone("leg*", "", (-0.04, 0.1, -0.32), (0.07, 0.04), ((0, 1, 0, -35, 35),)),
    Bone("claw*", "leg*", (0.13, 0.01, -0.02), (0.042, 0.034)),
]

FISH = [
    Bone("head", "", (0.32, 0, 0), (0.2, 0.1)),
    Bone("belly", "", (0.1, 0, -0.08), (0.17, 0.14)),
    *_chain("back", "", 4, (-0.19, 0, 0), (0.2, 0.065), (2, -22, 22)),
    Bone("upper tail", "back3", (-0.2, 0, 0.26), (0.055, 0.04), ((0, 0, 1, -25, 25),)),
    Bone("lower tail", "back3", (-0.2, 0, -0.24), (0.055, 0.04), ((0, 0, 1, -25, 25),)),
    Bone("back fin", "", (-0.2, 0, 0.33), (0.1, 0.04), ((1, 0, 0, -20, 20),)),
    Bone("side fin*", "", (-0.12, 0.32, -0.1), (0.07, 0.04), ((1, 0, 0, -30, 30), (0, 0, 1, -25, 25))),
]

SNAKE = [
    *_chain("front", "", 7, (0.17, 0, 0), (0.085, 0.07), (2, -34, 34), (1, -10, 5)),
    Bone("head", "front6", (0.15, 0, 0.02), (0.085, 0.06), ((0, 1, 0, -20, 10),)),
    *_chain("back", "", 8, (-0.17, 0, 0), (0.085, 0.045), (2, -34, 34)),
]

LIZARD = [
    Bone("hips", "", (-0.28, 0, 0), (0.13, 0.11), ((0, 0, 1, -18, 18),)),
    Bone("shoulders", "", (0.26, 0, 0), (0.13, 0.1), ((0, 0, 1, -18, 18),)),
    Bone("neck", "shoulders", (0.13, 0, 0.02), (0.085, 0.09), ((0, 0, 1, -25, 25), (0, 1, 0, -20, 10))),
    Bone("snout", "neck", (0.19, 0, -0.01), (0.09, 0.045)),
    *_chain("tail", "hips", 6, (-0.17, 0, -0.01), (0.1, 0.045), (2, -25, 25)),
    *(
        bone
        for name, parent, back in (("fore", "shoulders", 0.05), ("hind", "hips", -0.05))
        for bone in (
            Bone(f"{name} upper*", parent, (back, 0.24, 0.02), (0.065, 0.05), ((0, 0, 1, -32, 32),)),
            Bone(
                f"{name} lower*",
                f"{name} upper*",
                (back, 0.13, -0.17),
                (0.05, 0.042),
                ((0, 0, 1, -35, 35), (1, 0, 0, -20, 20)),
            ),
            Bone(f"{name} foot*", f"{name} lower*", (0.11, 0.03, -0.02), (0.042, 0.036)),
        )
    ),
]

ANT = [
    Bone("waist", "", (-0.26, 0, 0.04), (0.13, 0.09)),
    Bone("abdomen", "waist", (-0.3, 0, 0.06), (0.17, 0.2), ((0, 1, 0, -20, 20), (0, 0, 1, -20, 20))),
    Bone("neck", "", (0.24, 0, 0.02), (0.13, 0.09)),
    Bone("head", "neck", (0.13, 0, 0.02), (0.15, 0.14), ((0, 1, 0, -15, 15), (0, 0, 1, -20, 20))),
    Bone("feeler*", "head", (0.12, 0.17, 0.16), (0.055, 0.045), ((0, 0, 1, -20, 20),)),
    Bone("far feeler*", "feeler*", (0.22, 0.03, -0.03), (0.048, 0.045), ((0, 1, 0, -25, 25),)),
    *(
        bone
        for leg, (x, y) in enumerate(((0.28, 0.2), (0.0, 0.34), (-0.28, 0.2)))
        for bone in (
            Bone(f"coxa {leg}*", "", (0.6 * x, 0.5 * y, 0.0), (0.06, 0.055)),
            Bone(
                f"femur {leg}*", f"coxa {leg}*", (x, y, 0.22), (0.055, 0.05), ((0, 0, 1, -14, 14), (1, 0, 0, -22, 22))
            ),
            Bone(f"tibia {leg}*", f"femur {leg}*", (0.9 * x, 0.9 * y, -0.28), (0.05, 0.048), ((1, 0, 0, -25, 25),)),
            Bone(f"tarsus {leg}*", f"tibia {leg}*", (0.4 * x, 0.4 * y, -0.26), (0.048, 0.045), ((1, 0, 0, -25, 25),)),
        )
    ),
]

# Seat and back are spines with ribs so near that they close to boards.
CHAIR = [
    Bone("seat rib*", "", (0, 0.24, 0), (0.06, 0.06)),
    *_chain("front", "", 3, (0.09, 0, 0), (0.06, 0.06)),
    *(Bone(f"front rib {step}*", f"front{step}", (0, 0.24, 0), (0.06, 0.06)) for step in range(3)),
    *_chain("rear", "", 3, (-0.09, 0, 0), (0.06, 0.06)),
    *(Bone(f"rear rib {step}*", f"rear{step}", (0, 0.24, 0), (0.06, 0.06)) for step in range(3)),
    Bone("front leg*", "front rib 2*", (0, 0, -0.6), (0.05, 0.042), ((0, 1, 0, -12, 12), (1, 0, 0, -6, 10))),
    Bone("back leg*", "rear rib 2*", (-0.03, 0, -0.6), (0.05, 0.042), ((0, 1, 0, -12, 12), (1, 0, 0, -6, 10))),
    *_chain("rest", "rear2", 6, (-0.015, 0, 0.1), (0.055, 0.055), (1, -7, 4)),
    *(Bone(f"rest rib {step}*", f"rest{step}", (0, 0.23, 0), (0.055, 0.05)) for step in range(6)),
]

PLANS = {
    "ant": ANT,
    "biped": BIPED,
    "bird": BIRD,
    "chair": CHAIR,
    "fish": FISH,
    "giraffe": GIRAFFE,
    "hand": HAND,
    "lizard": LIZARD,
    "octopus": OCTOPUS,
    "quadruped": QUADRUPED,
    "snake": SNAKE,
}
