#!/usr/bin/env python3
"""What scenes cost as they grow: triangles, lights, nested media, pixels, samples. Prints Markdown tables.

    cargo build --release && python3 benches/scale.py target/release/tyndall

Each row is one scene that this script writes into a temporary folder: a Cornell box with a ball of medium, but for the one number that
changes. CPU seconds are of all threads, the fastest of three runs, less those of a run of one sample; "start" is that run, from the start
of the program to its end, on the wall. Memory is the largest resident set.
"""

import math
import os
import subprocess
import sys
import tempfile
import time

PROGRAM = os.path.abspath(sys.argv[1])
ROUNDS = 3

HEAD = """<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
<sensor type="perspective"><float name="fov" value="41"/><transform name="to_world">
<lookat origin="0,0,7.4" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><rfilter type="box"/><integer name="width" value="{width}"/><integer name="height" value="{width}"/></film></sensor>
"""
WALL = """<shape type="rectangle"><transform name="to_world"><scale value="2"/>{turn}</transform>
<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{colour}"/></bsdf></bsdf></shape>
"""
LAMP = """<shape type="rectangle"><transform name="to_world"><scale value="{size}"/><rotate x="1" angle="90"/>
<translate x="{x}" y="1.98" z="{z}"/></transform><emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>
"""
MEDIUM = """<medium type="homogeneous" id="m{index}"><float name="sigma_t" value="{sigma_t}"/><float name="albedo" value="0.8"/></medium>
"""


def walls():
    turns = [
        ('<rotate x="1" angle="-90"/><translate y="-2"/>', "0.7,0.7,0.7"),
        ('<rotate x="1" angle="90"/><translate y="2"/>', "0.7,0.7,0.7"),
        ('<translate z="-2"/>', "0.7,0.7,0.7"),
        ('<rotate y="1" angle="90"/><translate x="-2"/>', "0.6,0.1,0.1"),
        ('<rotate y="1" angle="-90"/><translate x="2"/>', "0.1,0.5,0.1"),
    ]
    return "".join(WALL.format(turn=turn, colour=colour) for turn, colour in turns)


def lamps(count):
    side = math.isqrt(count)
    size, radiance = 0.5 / side, 20.0
    place = lambda k: -0.6 + 1.2 * (k + 0.5) / side
    rows = (LAMP.format(size=size, radiance=radiance, x=place(k % side), z=place(k // side)) for k in range(count))
    return "".join(rows)


def icosphere(level):
    """An icosphere's vertices and triangles: 20 * 4^level of them."""
    t = (1 + 5**0.5) / 2
    unit = lambda p: tuple(x / math.sqrt(sum(y * y for y in p)) for x in p)
    points = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t)]
    points += [(0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    points = [unit(p) for p in points]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8)]
    faces += [(3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(level):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit(tuple(x + y for x, y in zip(points[a], points[b]))))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return points, faces


def mesh_ball(folder, level):
    name = f"ball{level}.obj"
    points, faces = icosphere(level)
    with open(os.path.join(folder, name), "w", encoding="ascii") as file:
        file.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points)
        file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    shape = f'<shape type="obj"><string name="filename" value="{name}"/><bsdf type="null"/><ref name="interior" id="m0"/></shape>\n'
    return len(faces), shape


def balls(depth):
    text = "".join(MEDIUM.format(index=k, sigma_t=0.5 + k) for k in range(depth))
    for k in range(depth):
        radius = 1.0 - k / (depth + 1)
        text += f'<shape type="sphere"><float name="radius" value="{radius}"/><bsdf type="null"/><ref name="interior" id="m{k}"/></shape>\n'
    return text


def scene(folder, name, body, width=128):
    path = os.path.join(folder, name + ".xml")
    with open(path, "w", encoding="ascii") as file:
        file.write(HEAD.format(width=width) + body + "</scene>\n")
    return path


def run(path, spp):
    """CPU seconds, seconds on the wall, and the largest resident set in MiB."""
    output = path[:-4] + ".exr"
    begin = time.monotonic()
    command = [PROGRAM, "render", path, "-o", output, "--spp", str(spp), "-q"]
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - begin
    if status != 0:
        sys.exit(f"{' '.join(command)} failed")
    return usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def measure(path, width, spp):
    starts = [run(path, 1) for _ in range(ROUNDS)]
    runs = [run(path, spp) for _ in range(ROUNDS)]
    start = min(start[0] for start in starts)
    cpu = max(min(each[0] for each in runs) - start, 1e-3)
    rate = 1e-6 * width * width * (spp - 1) / cpu
    return f"{rate:.2f} | {min(start[1] for start in starts):.2f} | {max(each[2] for each in runs):.0f}"


def table(title, rows):
    print(f"| {title} | Msamples/CPU s | start, s | memory, MiB |\n|--:|--:|--:|--:|")
    for label, path, width, spp in rows:
        print(f"| {label} | {measure(path, width, spp)} |", flush=True)
    print()


def main():
    with tempfile.TemporaryDirectory() as folder:
        room = walls() + lamps(1)
        medium = MEDIUM.format(index=0, sigma_t=6.0)
        meshes = [mesh_ball(folder, level) for level in range(2, 9)]
        rows = [(f"{count:,}", scene(folder, f"t{count}", room + medium + shape), 128, 32) for count, shape in meshes]
        table("triangles", rows)
        counts = [1, 16, 100, 1024, 10000]
        table("lights", [(f"{n:,}", scene(folder, f"l{n}", walls() + lamps(n)), 128, 32) for n in counts])
        depths = [1, 2, 4, 8, 16, 32]
        table("media in each other", [(n, scene(folder, f"n{n}", room + balls(n)), 128, 32) for n in depths])
        sizes = [(128, 64), (512, 8), (2048, 2)]
        rows = [(f"{w}×{w}, {spp} spp", scene(folder, f"r{w}", room + balls(1), w), w, spp) for w, spp in sizes]
        table("film", rows)


if __name__ == "__main__":
    main()
