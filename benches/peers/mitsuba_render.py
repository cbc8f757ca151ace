#!/usr/bin/env python3
"""Mitsuba 3's part of the benchmark `time_to_error`: renders one scene file with one configuration, once for each budget.

Prints one JSON object a line for each picture: spp, wall and cpu (seconds of the render alone), start_wall and start_cpu
(everything from the start of Python to the first picture, of one sample a pixel: reading, compiling), image (a file).

The scene file stays as it is, but for the integrator, the sampler and the size of the film, which the arguments name. A budget is
rendered again until nothing had to be compiled, at least twice, so that neither compiling nor the first touch of memory counts.
"""

import argparse
import json
import math
import pathlib
import resource
import sys
import time
import xml.etree.ElementTree as ElementTree

# Samples of one pass; more take gigabytes of memory.
MOST_SAMPLES_A_PASS = 1 << 24
# Rounds after which a kernel that is compiled anew each time is an error.
MOST_ROUNDS = 5


def cpu_time():
    """Seconds that all cores have spent on this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def set_value(element, tag, name, value):
    """Sets a property of a plugin, whether it is there or not."""
    for child in element:
        if child.get("name") == name:
            child.tag = tag
            child.set("value", str(value))
            return
    ElementTree.SubElement(element, tag, name=name, value=str(value))


def changed_scene(arguments):
    """The text of the scene file with integrator, sampler and size as the arguments say."""
    root = ElementTree.parse(arguments.scene).getroot()
    integrators, sensors = root.findall("integrator"), root.findall("sensor")
    if len(integrators) != 1 or len(sensors) != 1:
        sys.exit(f"{arguments.scene}: one <integrator> and one <sensor> are needed at the top of the file")
    integrators[0].set("type", arguments.integrator)
    if arguments.rr_depth is not None:
        set_value(integrators[0], "integer", "rr_depth", arguments.rr_depth)
    films = sensors[0].findall("film")
    if len(films) != 1:
        sys.exit(f"{arguments.scene}: one <film> is needed in the sensor")
    width, height = (int(side) for side in arguments.size.split("x"))
    set_value(films[0], "integer", "width", width)
    set_value(films[0], "integer", "height", height)
    set_value(films[0], "string", "pixel_format", "rgb")
    set_value(films[0], "string", "component_format", "float32")
    for sampler in sensors[0].findall("sampler"):
        sensors[0].remove(sampler)
    sampler = ElementTree.SubElement(sensors[0], "sampler", type=arguments.sampler)
    ElementTree.SubElement(sampler, "integer", name="sample_count", value="16")
    if not arguments.emitter_sampling:
        for medium in root.iter("medium"):
            set_value(medium, "boolean", "sample_emitters", "false")
    largest = max((count for kind, count in arguments.budgets if kind == "spp"), default=0)
    if largest * width * height > MOST_SAMPLES_A_PASS:
        # A power of two of samples, so that it divides budgets that are powers of two.
        passes = 2 ** math.floor(math.log2(max(MOST_SAMPLES_A_PASS / (width * height), 1)))
        set_value(integrators[0], "integer", "samples_per_pass", passes)
    return ElementTree.tostring(root, encoding="unicode")


def parse_budgets(text):
    budgets = []
    for part in text.split(","):
        kind, value = part.split(":")
        budgets.append((kind, int(value) if kind == "spp" else float(value)))
    return budgets


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="store_true", help="print Mitsuba's version and end")
    parser.add_argument("--scene", type=pathlib.Path)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--integrator", default="volpath")
    parser.add_argument("--sampler", default="independent")
    parser.add_argument("--rr-depth", type=int)
    parser.add_argument("--no-emitter-sampling", dest="emitter_sampling", action="store_false")
    parser.add_argument("--size", help="WIDTHxHEIGHT")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budgets", type=parse_budgets, help="spp:N or seconds:S, separated by commas")
    parser.add_argument("--output", type=pathlib.Path, help="folder for the pictures")
    arguments = parser.parse_args()
    if not arguments.version and None in (arguments.scene, arguments.size, arguments.budgets, arguments.output):
        parser.error("--scene, --size, --budgets and --output are needed")
    return arguments


class Renderer:
    """A scene that is loaded, and a clock."""

    def __init__(self, arguments):
        import drjit
        import mitsuba

        mitsuba.set_variant(arguments.variant)
        mitsuba.set_log_level(mitsuba.LogLevel.Error)
        self.drjit, self.mitsuba = drjit, mitsuba
        self.compiles = not arguments.variant.startswith("scalar")
        # Names of files in the scene are relative to its folder.
        mitsuba.file_resolver().append(str(arguments.scene.resolve().parent))
        self.scene = mitsuba.load_string(changed_scene(arguments))

    def render(self, spp, seed):
        """A picture, the wall and CPU time that it took, and how many kernels were compiled for it."""
        import numpy

        if self.compiles:
            self.drjit.set_flag(self.drjit.JitFlag.KernelHistory, True)
            self.drjit.kernel_history_clear()
        wall, cpu = time.perf_counter(), cpu_time()
        # The conversion waits until the picture is there.
        pixels = numpy.array(self.mitsuba.render(self.scene, spp=spp, seed=seed))
        wall, cpu = time.perf_counter() - wall, cpu_time() - cpu
        compiled = 0
        if self.compiles:
            kernels = self.drjit.kernel_history([self.drjit.KernelType.JIT])
            compiled = sum(not kernel["cache_hit"] or kernel["cache_disk"] for kernel in kernels)
        return pixels[:, :, :3], wall, cpu, compiled

    def timed(self, spp, seed):
        """A picture and its times, after the same render with other seeds: at least one, until nothing is compiled."""
        for round in range(MOST_ROUNDS):
            _, _, _, compiled = self.render(spp, seed + 10_000 * (round + 1))
            if compiled == 0:
                break
        pixels, wall, cpu, compiled = self.render(spp, seed)
        if compiled:
            sys.exit(f"Mitsuba compiles {compiled} kernels anew for each render, which cannot be timed")
        return pixels, wall, cpu

    def samples(self, budget, seed):
        """The samples of a budget. For seconds, the square that comes closest from below, by the time of 16 samples."""
        kind, value = budget
        if kind == "spp":
            return value
        _, wall, _ = self.timed(16, seed)
        return max(2, math.floor(math.sqrt(16 * value / wall))) ** 2


def main():
    start = time.perf_counter()
    arguments = parse_arguments()
    if arguments.version:
        import mitsuba

        print(json.dumps({"version": mitsuba.__version__}))
        return
    renderer = Renderer(arguments)
    renderer.render(1, arguments.seed)
    start_wall, start_cpu = time.perf_counter() - start, cpu_time()
    for index, budget in enumerate(arguments.budgets):
        spp = renderer.samples(budget, arguments.seed)
        pixels, wall, cpu = renderer.timed(spp, arguments.seed)
        path = arguments.output / f"{index}.exr"
        renderer.mitsuba.Bitmap(pixels.copy()).write(str(path))
        facts = {"spp": spp, "wall": wall, "cpu": cpu, "image": str(path)}
        print(json.dumps(facts | {"start_wall": start_wall, "start_cpu": start_cpu}), flush=True)


if __name__ == "__main__":
    main()
