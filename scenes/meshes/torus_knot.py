#!/usr/bin/env python3
"""Writes torus_knot.obj: a closed tube around the (2, 3) torus knot, about as large as a sphere of radius 1.

The file is kept beside this script, so this only needs to run again to change the mesh:

    python3 scenes/meshes/torus_knot.py > scenes/meshes/torus_knot.obj
"""

from math import cos, pi, sin, sqrt

# The knot winds twice around the axis of symmetry (z) and three times around the core circle of the torus.
WINDINGS_AXIS = 2
WINDINGS_CORE = 3
CORE_RADIUS = 0.56  # scene units
TORUS_RADIUS = 0.25  # of the torus that the knot lies on; scene units
TUBE_RADIUS = 0.17  # scene units; strands on opposite sides of the torus stay 0.16 units apart
RINGS = 160  # vertices along the knot
SIDES = 20  # vertices around the tube


def add(a, b, scale=1.0):
    return tuple(x + scale * y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalize(a):
    return tuple(x / sqrt(dot(a, a)) for x in a)


def knot(t):
    """The point of the knot at parameter t, in [0, 2π)."""
    r = CORE_RADIUS + TORUS_RADIUS * cos(WINDINGS_CORE * t)
    return (r * cos(WINDINGS_AXIS * t), r * sin(WINDINGS_AXIS * t), TORUS_RADIUS * sin(WINDINGS_CORE * t))


def ring(t):
    """The vertices around the knot at parameter t, counter-clockwise when the knot comes towards the eye."""
    step = 1e-4
    here, before, after = knot(t), knot(t - step), knot(t + step)
    tangent = normalize(add(after, before, -1.0))
    # The Frenet frame closes on itself after one turn, because the curvature of this knot is nowhere zero.
    bend = add(add(after, before), here, -2.0)
    normal = normalize(add(bend, tangent, -dot(bend, tangent)))
    binormal = cross(tangent, normal)
    angles = (2 * pi * side / SIDES for side in range(SIDES))
    return [add(add(here, normal, TUBE_RADIUS * cos(a)), binormal, TUBE_RADIUS * sin(a)) for a in angles]


def main():
    print(f"# A tube around the ({WINDINGS_AXIS}, {WINDINGS_CORE}) torus knot: closed, normals outwards. See torus_knot.py.")
    for i in range(RINGS):
        for x, y, z in ring(2 * pi * i / RINGS):
            print(f"v {x:.5f} {y:.5f} {z:.5f}")
    for i in range(RINGS):
        for j in range(SIDES):
            a, b = i * SIDES + j + 1, i * SIDES + (j + 1) % SIDES + 1
            c, d = (i + 1) % RINGS * SIDES + (j + 1) % SIDES + 1, (i + 1) % RINGS * SIDES + j + 1
            print(f"f {a} {b} {c}")
            print(f"f {a} {c} {d}")


if __name__ == "__main__":
    main()
