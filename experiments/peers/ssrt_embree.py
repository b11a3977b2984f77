"""Embree, called directly, beside our screen-space rays: the same cosine rays on the same depth maps, in turns.

    python3 experiments/peers/ssrt_embree.py --binary build/clerestory [--cpu haswell] [--only "office"]

Needs a C++ compiler and libembree-dev (Embree 3), which building clerestory needs, numpy and safetensors. ssrt_embree.cpp is compiled
into build/peers with the compiler's best for this CPU; of the ways of calling (single rays, a stream, packets as wide as
the CPU has them) the one that is fastest in the first round counts. Ours walks with normals, past cells that face away: what is hit is the surface's
front, as triangles have it. Embree's tree is built beforehand, as are our pyramids. --cpu haswell: both as on a CPU
with AVX2 (experiments/peers/older_cpu.sh, Embree's isa=avx2).

Prints `RATIO <name> <our time / peer's time> bar <most>` a row and `HITS <name> <ours> <peer's>`; then, of ours alone,
`FACING <name> <rate with / without> bar <least>` and `DOUBLING <name> <time of a ray / at half the size> bar <most>`. Hit
rates are to be within 1 %; depth without order has no surface that both mean, and no such bar. A row is marked `busy` where
another process took over 5 % of the cores meanwhile. Exit 1 when a bar is missed.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np
from load import Load
from safetensors.numpy import load_file

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WIDE_BAR, NARROW_BAR = 1 / 1.5, 1 / 1.2  # our time over Embree's, with vectors of 16 floats and of 8
FACING_BAR, DOUBLING_BAR, HITS_BAR = 0.8, 1.4, 0.01


def compiled():
    folder = ROOT / "build/peers"
    folder.mkdir(parents=True, exist_ok=True)
    source, program = HERE / "ssrt_embree.cpp", folder / "ssrt_embree"
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        command = [os.environ.get("CXX", "c++"), "-std=c++20", "-O3", "-march=native", source, "-o", program]
        subprocess.run([*map(str, command), "-lembree3", "-pthread"], check=True)
    return program


def ours(options, only, runs, *more):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bench.json")
        command = [options.binary, "bench", "ssrt", "--quiet", f"--runs={runs}", f"--json={path}", *more]
        command += [f"--only={only}"] if only else []
        if options.cpu:
            command = ["bash", str(HERE / "older_cpu.sh"), options.cpu, *command]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")
        with open(path, encoding="utf-8") as file:
            return json.load(file)["ssrt"]


def write_scene(path, tensors):
    """As ssrt_embree.cpp reads it."""
    height, width = tensors["depth"].shape
    with open(path, "wb") as file:
        np.array([width, height, len(tensors["pixel"])], np.int32).tofile(file)
        for name in ("camera", "depth", "pixel", "direction"):
            tensors[name].tofile(file)


def peer(program, scene, options, runs, ways):
    """way -> hit rate, seconds; of `ways`, or of all."""
    command = [program, scene, options.threads, runs, "avx2" if options.cpu else "", *ways]
    lines = subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout.splitlines()
    return {way: (float(rate), list(map(float, seconds))) for way, rate, *seconds in map(str.split, lines)}


class Row:
    """One scene in one size: runs of both, gathered round by round."""

    def __init__(self, row):
        self.name, self.scene, self.width, self.rays = row["name"], row["scene"], row["width"], row["rays"]
        self.file = f"{row['scene']}_{row['width']}x{row['height']}"
        self.seconds, self.rates, self.ways, self.others = {}, {}, {}, 0.0

    def round(self, options, program, scene, runs):
        with Load() as load:
            for found in ours(options, self.sized(), runs)["rows"]:
                self.seconds.setdefault(found["facing"], []).extend(found["runs"])
                self.rates[found["facing"]] = found["hit_rate"]
            for way, (rate, seconds) in peer(program, scene, options, runs, self.fastest()[:1]).items():
                self.ways.setdefault(way, (rate, []))[1].extend(seconds)
        self.others = max(self.others, load.others)

    def sized(self):
        return self.name.removesuffix(", facing")

    def busy(self):
        return f"  busy: others took {100 * self.others:.0f} %" if self.others > 0.05 else ""

    def of_a_ray(self, facing):
        return statistics.median(self.seconds[facing]) / self.rays

    def fastest(self):
        if not self.ways:
            return ()
        way = min(self.ways, key=lambda w: statistics.median(self.ways[w][1]))
        return way, self.ways[way][0], statistics.median(self.ways[way][1]) / self.rays


def million(seconds):
    return f"{1e-6 / seconds:.2f}"


class Judge:
    """Prints lines, and remembers what misses its bar."""

    def __init__(self, bar):
        self.bar, self.missed, self.rows = bar, [], []

    def line(self, text, good):
        print(text + ("" if good else "  missed"), flush=True)
        if not good:
            self.missed.append(" ".join(text.split("  ")[0].split()[:-1]))

    def row(self, row):
        way, rate, seconds = row.fastest()
        ratio, apart = row.of_a_ray(True) / seconds, abs(row.rates[True] - rate)
        speeds = f"({million(row.of_a_ray(True))}, {million(seconds)} rays/us by {way})"
        self.line(f"RATIO {row.name} {ratio:.3f}  bar {self.bar:.3f}  {speeds}{row.busy()}", ratio <= self.bar)
        self.line(f"HITS {row.name} {row.rates[True]:.4f}  peer {rate:.4f}", apart <= HITS_BAR or row.scene == "noise")
        share = row.of_a_ray(False) / row.of_a_ray(True)
        self.line(f"FACING {row.sized()} {share:.3f}  bar {FACING_BAR}", share >= FACING_BAR)
        for half in (r for r in self.rows if r.scene == row.scene and 2 * r.width == row.width):
            grown = row.of_a_ray(True) / half.of_a_ray(True)
            self.line(f"DOUBLING {row.name} {grown:.3f}  bar {DOUBLING_BAR}", grown <= DOUBLING_BAR)
        self.rows.append(row)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="build/clerestory")
    parser.add_argument("--cpu", choices=["haswell"], help="both as on such a CPU")
    parser.add_argument("--only", default="", help="rows whose name contains this")
    parser.add_argument("--runs", type=int, default=9, help="at least, of each program, in rounds of three")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="of Embree; ours takes every core")
    options = parser.parse_args()
    program, each = compiled(), min(3, options.runs)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        found = ours(options, options.only, 1, f"--write={folder}")
        rows = [Row(row) for row in found["rows"] if row["facing"]]
        wide = found["float_width"] >= 16
        print(f"{found['device']}, vectors of {found['float_width']} floats; load {os.getloadavg()[0]:.2f}")
        judge = Judge(WIDE_BAR if wide else NARROW_BAR)
        for row in rows:
            scene = folder / row.file
            write_scene(scene, load_file(folder / f"{row.file}.safetensors"))
            for _ in range(-(-options.runs // each)):
                row.round(options, program, scene, each)
            scene.unlink()
            judge.row(row)
    if judge.missed:
        print(f"missed: {'; '.join(judge.missed)}")
        sys.exit(1)


if __name__ == "__main__":
    main()
