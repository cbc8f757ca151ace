"""Writes the files of sparse volumes that the tests read; it was run with OpenVDB 10.0.1 (Debian's python3-openvdb, libopenvdb-tools
and libnanovdb-tools 10.0.1-2). The repository has them packed by `gzip -9n`.

Two are made in C++ from those below: `fog_zip.vdb` by openvdb::io::File::setCompression(COMPRESS_ZIP | COMPRESS_ACTIVE_MASK) after
setGridClass(GRID_UNKNOWN), since OpenVDB packs no fog volumes by zlib, and `instances.vdb` from `density.vdb` and its copyGrid(), called
"copy", with the transform of voxels of size 2.
"""

import subprocess

import pyopenvdb as vdb


def rule(i, j, k):
    return ((7 * i + 13 * j + 29 * k) % 11) / 16.0


def fog(name, background=0.0):
    grid = vdb.FloatGrid(background)
    grid.name = name
    grid.gridClass = "fog volume"
    return grid


def put(grid, low, high):
    voxels = grid.getAccessor()
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                voxels.setValueOn((i, j, k), rule(i, j, k))


def run(*command):
    subprocess.run(command, check=True)


# Voxels on both sides of the origin, and a node of 8³ that is a tile.
density = fog("density")
put(density, (-3, 2, -9), (10, 7, 4))
density.fill((16, 0, 0), (23, 7, 7), 0.5)
density.transform = vdb.createLinearTransform([[0.25, 0, 0, 0], [0, 0.25, 0, 0], [0, 0, 0.25, 0], [1, 2, 3, 1]])
# Half precision, another background, and inactive voxels within.
heat = fog("heat", 0.25)
heat.saveFloatAsHalf = True
put(heat, (0, 0, 0), (2, 1, 3))
heat.getAccessor().setValueOff((1, 1, 1), 0.5)
heat.getAccessor().setValueOff((1, 0, 1), 0.25)
heat.transform = vdb.createLinearTransform([[-0.5, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]])
# Three channels, turned, sheared and moved.
tint = vdb.Vec3SGrid((0, 0, 0))
tint.name = "tint"
for i in range(3):
    for j in range(2):
        tint.getAccessor().setValueOn((i, j, -1), (i / 4, j / 2, 1.0))
tint.transform = vdb.createLinearTransform([[0.6, 0.8, 0, 0], [-0.8, 0.6, 0, 0], [0, 0.5, 2, 0], [1, 0, -1, 1]])
# What is refused.
surface = vdb.createLevelSetSphere(radius=3, voxelSize=1.0)
surface.name = "surface"
mask = vdb.BoolGrid()
mask.name = "mask"
mask.fill((0, 0, 0), (1, 1, 1), True)
vdb.write("fog.vdb", [density, heat, tint, surface, mask, fog("nothing")])
vdb.write("density.vdb", [density])
for name, corner in [("wide", (3000, 2000, 1000)), ("stray", (1000, 600, 500))]:
    grid = fog(name)
    grid.getAccessor().setValueOn((0, 0, 0), 1.0)
    grid.getAccessor().setValueOn(corner, 1.0)
    vdb.write(name + ".vdb", [grid])
twins = [fog("twin"), fog("twin")]
put(twins[0], (0, 0, 0), (1, 1, 1))
put(twins[1], (0, 0, 0), (1, 1, 2))
vdb.write("twins.vdb", twins)
# A fifth of a unit a voxel, turned about z by the angle of (4, 3, 5), and moved.
smoke = fog("smoke")
smoke.fill((0, 0, 0), (5, 4, 3), 0.5)
smoke.transform = vdb.createLinearTransform(
    [[0.16, 0.12, 0, 0], [-0.12, 0.16, 0, 0], [0, 0, 0.2, 0], [-0.25, -0.75, -0.5, 1]]
)
vdb.write("constant.vdb", [smoke])

for codec in ["active", "none"]:
    name = "density_active.vdb" if codec == "active" else "density_plain.vdb"
    run("vdb_tool", "-read", "density.vdb", "-write", "codec=" + codec, name)
run("nanovdb_convert", "-f", "density.vdb", "density.nvdb")
run("nanovdb_convert", "-f", "-b", "density.vdb", "density_blosc.nvdb")
run("nanovdb_convert", "-f", "-b", "constant.vdb", "constant.nvdb")
run("nanovdb_convert", "-f", "-z", "fog.vdb", "fog.nvdb")
for codes in ["fp4", "fp8", "fp16", "fpN"]:
    run("nanovdb_convert", "-f", "-z", "--" + codes, "density.vdb", codes + ".nvdb")
