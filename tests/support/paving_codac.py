"""Paves one visibility set with codac: the volume of the inner boxes, and the processor time.

The case of `crates/posegate-site/examples/paving.rs`: a tag of 20 cm, 2 m before the goal and 0.3 m above the camera. Yaw is scaled so
that a degree counts as 2 cm, as the resolution does. Called by `cargo xtask paving` with the smallest box in metres.
"""

import json
import math
import sys
import time

from codac import (
    AnalyticFunction,
    IntervalVector,
    PavingInOut,
    SepInverse,
    VectorVar,
    cos,
    oo,
    pave,
    sin,
    sqr,
    sqrt,
)

RAD_PER_M = (3.141592653589793 / 180.0) / 0.02
F, WIDTH, HEIGHT = 615.0, 640.0, 480.0
X, Z, HALF = 2.0, 0.3, 0.1
D, PHI, PSI = 3.0, 25.0, 50.0


def separators():
    p = VectorVar(3)
    a = p[2] * RAD_PER_M
    c, s = cos(a), sin(a)

    def seen(x, y, z):
        dx, dy = x - p[0], y - p[1]
        return c * dx + s * dy, c * dy - s * dx, z

    def at_least_zero(expression):
        return SepInverse(AnalyticFunction([p], expression), [0, oo])

    all_of = None

    def add(separator):
        nonlocal all_of
        all_of = separator if all_of is None else all_of & separator

    # Nine constraints imply all: the robot moves in the plane, so a corner's side does not depend on its height, and a corner
    # below the upper edge of the image is in front of the camera.
    for y in (-HALF, HALF):
        depth, left, up = seen(X, y, Z + HALF)
        add(at_least_zero(WIDTH / 2 * depth - F * left))
        add(at_least_zero(WIDTH / 2 * depth + F * left))
        add(at_least_zero(HEIGHT / 2 * depth - F * up))
    depth, left, _ = seen(X, 0.0, Z)
    distance = sqrt(sqr(X - p[0]) + sqr(p[1]) + Z * Z)
    cosine = lambda degrees: math.cos(math.radians(degrees))
    add(at_least_zero(D - distance))
    add(at_least_zero(depth - cosine(PHI) * distance))
    add(at_least_zero((X - p[0]) - cosine(PSI) * distance))
    return all_of


def main():
    smallest = float(sys.argv[1])
    box = IntervalVector([[-1.5, 2.5], [-2.5, 2.5], [-90 * 0.02, 90 * 0.02]])
    separator = separators()
    start = time.process_time()
    paving = pave(box, separator, smallest)
    seconds = time.process_time() - start
    inner = sum(b.volume() for b in paving.boxes(PavingInOut.inner))
    outer = sum(b.volume() for b in paving.boxes(PavingInOut.bound))
    name = f"paving, codac to {smallest} m"
    for what, value, unit in (("proven inside", inner, "m3"), ("undecided", outer, "m3"), ("processor time", seconds, "s")):
        print(json.dumps({"name": f"{name}: {what}", "value": value, "unit": unit, "goal": None}))


main()
