#!/usr/bin/env python3
"""Cases with a known answer, on which numbers or conventions fail silently: the same files by Tyndall and by Mitsuba 3.

    benches/peers/numerics.py TYNDALL [FOLDER]

prints a Markdown table: exact value, Mitsuba's, Tyndall's, each the mean of the picture with its standard error. The scenes are
written to FOLDER (a temporary one by default). It needs Mitsuba's Python package; the variant is llvm_ad_rgb, the integrator volpath.
"""

import math
import pathlib
import subprocess
import sys
import tempfile

CUBE = """    <shape type="cube">
        <transform name="to_world"><scale value="{half}"/><translate x="{x}" y="{y}" z="{z}"/></transform>
        <bsdf type="null"/>
        <medium name="interior" type="homogeneous">{medium}</medium>{exterior}
    </shape>
"""


def medium(sigma_t, albedo, g=None):
    def rgb(name, value):
        value = value if isinstance(value, tuple) else (value,) * 3
        return f'<rgb name="{name}" value="{value[0]!r}, {value[1]!r}, {value[2]!r}"/>'

    # Mitsuba takes colours up to 1 here.
    largest = max(sigma_t) if isinstance(sigma_t, tuple) else sigma_t
    sigma_t = tuple(value / largest for value in sigma_t) if isinstance(sigma_t, tuple) else 1.0
    phase = "" if g is None else f'<phase type="hg"><float name="g" value="{g!r}"/></phase>'
    return rgb("sigma_t", sigma_t) + f'<float name="scale" value="{largest!r}"/>' + rgb("albedo", albedo) + phase


def scene(shapes, origin, target, spp, depth=-1):
    return f"""<scene version="3.0.0">
    <integrator type="volpath"><integer name="max_depth" value="{depth}"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="0.01"/>
        <float name="near_clip" value="{abs(origin[2] - target[2]) * 1e-3!r}"/>
        <float name="far_clip" value="{max(abs(origin[2] - target[2]), 1) * 1e4!r}"/>
        <transform name="to_world">
            <lookat origin="{origin[0]!r}, {origin[1]!r}, {origin[2]!r}" target="{target[0]!r}, {target[1]!r}, {target[2]!r}" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="32"/><integer name="height" value="32"/>
            <string name="pixel_format" value="rgb"/><rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
{shapes}</scene>
"""


def cube(scale, contents, at=(0.0, 0.0, 0.0), exterior=""):
    return CUBE.format(half=repr(scale / 2), medium=contents, x=repr(at[0]), y=repr(at[1]), z=repr(at[2]), exterior=exterior)


def before(scale, contents, spp=256, at=(0.0, 0.0, 0.0)):
    """A cube of side `scale`, seen from in front of it."""
    x, y, z = at[0] + 0.1 * scale, at[1] + 0.2 * scale, at[2]
    return scene(cube(scale, contents, at), (x, y, z + 4.0 * scale), (x, y, z), spp)


def cases():
    absorbs = math.exp(-1.0)
    for scale in (1.0, 1e-3, 1e-4, 1e-6):
        yield f"absorption, cube of side {scale:g}", (absorbs,) * 3, before(scale, medium(1.0 / scale, 0.0))
    yield "absorption, translated by 1e5 sides", (absorbs,) * 3, before(1.0, medium(1.0, 0.0), at=(1e5, -1e5, 1e5))
    # Chandrasekhar's H functions: H(1) and the moments give 1 - sqrt(1 - albedo) H(1) = .28525 for normal incidence.
    for sigma in (1e2, 1e3, 1e4, 1e5):
        yield f"half space, albedo .8, {sigma:g} mean free paths", (0.28525,) * 3, before(1.0, medium(sigma, 0.8))
    yield "half space, albedo .8, side 1e-4, 1000 mean free paths", (0.28525,) * 3, before(1e-4, medium(1e7, 0.8))
    for g in (0.9999, -0.9999):
        yield f"furnace, g = {g}", (1.0,) * 3, before(1.0, medium(3.0, 1.0, g))
    yield "furnace, extinction (.1, 1, 10)", (1.0,) * 3, before(1.0, medium((0.1, 1.0, 10.0), 1.0), spp=4096)
    inside = scene(cube(2.0, medium(1.0, 0.0)), (0.1, 0.2, 0.0), (0.1, 0.2, -1.0), 256)
    yield "camera inside, no medium named at it", (absorbs,) * 3, inside
    # A ray through 1 + 1 + 1 units of two media: exp(-(.25 + 1 + .25)).
    nested = cube(3.0, medium(0.25, 0.0)) + cube(1.0, medium(1.0, 0.0))
    yield "a cube in a cube, no exterior named", (math.exp(-1.5),) * 3, scene(nested, (0.1, 0.2, 8.0), (0.1, 0.2, 0.0), 256)


def tyndall(program, path, spp):
    image = path.with_suffix(".exr")
    subprocess.run([program, "render", path, "-o", image, "--spp", str(spp), "--quiet"], check=True)
    return image


def statistics(pixels):
    """Mean and standard error of each channel, from the pixels."""
    import numpy as np

    flat = pixels.reshape(-1, pixels.shape[-1])[:, :3].astype(np.float64)
    return flat.mean(axis=0), flat.std(axis=0, ddof=1) / math.sqrt(len(flat))


def show(mean, error):
    spread = max(mean) - min(mean)
    values = mean if spread > 4 * max(error) + 1e-6 else mean[:1]
    return ", ".join(f"{value:.4f}" for value in values) + f" ± {max(error):.4f}"


def main():
    import mitsuba as mi
    import numpy as np

    mi.set_variant("llvm_ad_rgb")
    program = sys.argv[1]
    folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    print("| case | exact | Mitsuba %s | Tyndall |\n|---|---|---|---|" % mi.__version__)
    for index, (name, exact, text) in enumerate(cases()):
        path = folder / f"numerics_{index}.xml"
        path.write_text(text)
        spp = int(text.split('name="sample_count" value="')[1].split('"')[0])
        theirs = statistics(np.array(mi.render(mi.load_file(str(path)), spp=spp, seed=1)))
        ours = statistics(np.array(mi.Bitmap(str(tyndall(program, path, spp)))))
        value = f"{exact[0]:.4f}" if len(set(exact)) == 1 else ", ".join(f"{value:.4f}" for value in exact)
        print(f"| {name} | {value} | {show(*theirs)} | {show(*ours)} |", flush=True)


if __name__ == "__main__":
    main()
