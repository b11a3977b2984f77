"""PyTorch (oneDNN on CPUs) and ours side by side in one run: convolutions, products, trunks, training steps, the light's MLPs.

    python3 experiments/peers/torch_nets.py --binary build/clerestory [--before OLDER] [--families conv ...] [--only TEXT]

Needs torch and torchvision, of any build (the CPU wheels will do: pip install torch torchvision); nothing else in the
project needs them, nor this script. Both programs take turns, round by round, on the same cores with the same number of
threads; a figure is the median of all runs of its program. PyTorch is taken in whichever layout, channels-last or its
default, is faster. Weights are random on both sides. Ours pads 160x120 to 160x128 as its trainer does, and PyTorch is given
the padded batch: the same arithmetic.

Prints a line `RATIO <name> <our time / peer's time> bar <most> goal <wanted>` a row, marked `busy` where another process took
over 5 % of the cores meanwhile: such a row says little. "conv" rows are weighted by FLOP: all shapes of the paper's and the
compact preset, one after the other. With --before there are rows `BEFORE <name> <our time / the older one's>` too, and what has no peer is
judged by them. Exit 1 when a bar is missed.

On a GPU: `--device NAME --peer-device cuda`; PyTorch then multiplies in float32 (no TF32), and a run ends when the GPU has.
Bars are those of CPUs, "busy" says nothing there.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import torch
import torch.nn.functional as F
import torchvision

from load import Load
from mgnet_torch import MGNet, Encoder, losses, random_batch

# Most that our time may be of the peer's, and where we want to be. MLPs differ by the width of the device's vectors.
BARS = {
    "conv forward and backward data": (1.1, 0.9),
    "conv backward weights": (1.25, 1.0),
    "gemm": (1.1, 1.0),
    "DenseNet121 forward, 320x240, batch 1": (1.0, 0.75),
    "DenseNet121 forward, 320x240, batch 4": (1.0, 0.75),
    "ResNet34 forward, 320x240, batch 1": (1.0, 0.75),
    "ResNet34 forward, 320x240, batch 4": (1.0, 0.75),
    "MGNet compact step, 160x120, batch 8": (0.85, 0.6),
    "MGNet shared step, 160x120, batch 8": (0.85, 0.6),
    "MGNet paper step, 320x240, batch 2": (1.0, 0.7),
    "in view, paper": ((1.0, 0.7), (0.8, 0.7)),
    "LightNet's MLP, paper, both ways": ((1.0, 0.7), (0.9, 0.7)),
    "field, paper": ((0.25, 0.08), (0.12, 0.08)),
}
BARS_BEFORE = {"light compact step, 160x120, batch 8": (0.5, 0.35)}
LAYOUTS = (torch.channels_last, torch.contiguous_format)


def bar_of(name, bars, wide):
    bar = bars.get(name)
    return bar[wide] if bar and isinstance(bar[0], tuple) else bar


# Ours: seconds of runs by row.


def ours(binary, family, runs, only, device):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bench.json")
        command = [binary, "bench", family, "--quiet", "--no-clblast", f"--runs={runs}", f"--json={path}"]
        if only:
            command.append(f"--only={only}")
        if device:
            command.append(f"--device={device}")
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")
        with open(path, encoding="utf-8") as file:
            return json.load(file)[family]


def only_value(by_tile):
    return next(iter(by_tile.values()))


def our_rows(family, result):
    """name -> runs, and the shapes that the peer is to be measured at."""
    if family == "conv":
        rows = {}
        for shape in distinct_shapes(result):
            for part, runs in only_value(shape["runs"]).items():
                rows[(shape_key(shape), part)] = runs
        return rows
    if family == "gemm":
        return {(s["rows"], s["columns"], s["depth"]): only_value(s["runs"]) for s in result["shapes"]}
    if family == "mlp":
        return {n["name"]: only_value(n["runs"]) for n in result["nets"]}
    return {row["name"]: row["runs"] for row in result["rows"]}


def shape_key(shape):
    return (tuple(shape["x"]), tuple(shape["w"]), shape["stride"], shape["pad"])


def distinct_shapes(result):
    shapes = {}
    for group in result["groups"]:
        for shape in group["shapes"]:
            shapes.setdefault(shape_key(shape), shape)
    return list(shapes.values())


# The peer: a job is a function; jobs of a row in each layout.


def conv_jobs(key, layout):
    x, w = (torch.randn(s).contiguous(memory_format=layout) for s in key[:2])
    stride, pad = [key[2]] * 2, [key[3]] * 2
    dy = torch.randn_like(F.conv2d(x, w, None, stride, pad))

    def backward(mask):
        return torch.ops.aten.convolution_backward(dy, x, w, [0], stride, pad, [1, 1], False, [0, 0], 1, mask)

    return {
        "forward": lambda: F.conv2d(x, w, None, stride, pad),
        "data": lambda: backward([True, False, False]),
        "weights": lambda: backward([False, True, False]),
    }


def gemm_job(key, _):
    rows, columns, depth = key
    a, b = torch.randn(rows, depth), torch.randn(depth, columns)
    return lambda: a @ b


def densenet_job(batch):
    def make(layout):
        net = Encoder(growth=32, first=64).eval().to(memory_format=layout)
        image = torch.rand(batch, 3, 240, 320).contiguous(memory_format=layout)
        return lambda: net(image)

    return make


def resnet_job(batch):
    def make(layout):
        whole = torchvision.models.resnet34()
        net = torch.nn.Sequential(*list(whole.children())[:-2]).eval().to(memory_format=layout)
        image = torch.rand(batch, 3, 240, 320).contiguous(memory_format=layout)
        return lambda: net(image)

    return make


def mgnet_forward_job(preset, batch, width, height):
    def make(layout):
        net = MGNet(preset).eval().to(memory_format=layout)
        image = torch.rand(batch, 3, height, width).contiguous(memory_format=layout)
        return lambda: net(image)

    return make


def mgnet_job(preset, batch, width, height):
    def make(layout):
        net = MGNet(preset).to(memory_format=layout)
        data = {k: v.contiguous(memory_format=layout) for k, v in random_batch(batch, height, width).items()}
        adam = torch.optim.Adam(net.parameters(), lr=1e-5, betas=(0.5, 0.999))

        def step():
            with torch.enable_grad():
                adam.zero_grad()
                losses(net(data["image"]), data)["loss"].backward()
            adam.step()

        return step

    return make


class LightMlp:
    """LightNet's MLP in the paper's size: what a hit pixel gives to the first and sixth layer is read from maps."""

    width, frequencies, layers, again = 512, 64, 9, 5

    def __init__(self, rays, height=240, width=320):
        make = lambda *shape: (torch.randn(*shape) * (2 / shape[-1]) ** 0.5).requires_grad_()
        self.direction = torch.randn(rays, 3)
        self.waves = torch.randn(self.frequencies, 3)
        self.surface = torch.randn(height * width, 2 * self.width, requires_grad=True)
        self.features = torch.randn(height * width // 4, 2 * self.width, requires_grad=True)
        self.hit = torch.randint(height * width, (rays,))
        self.cell = self.hit // width // 2 * (width // 2) + self.hit % width // 2
        self.hidden = [make(self.width, self.width) for _ in range(self.layers - 1)]
        self.along = [make(self.width, 2 * self.frequencies) for _ in range(2)]
        self.biases = [torch.zeros(self.width, requires_grad=True) for _ in range(self.layers)]
        self.out, self.out_bias = make(3, self.width), torch.zeros(3, requires_grad=True)
        self.slope = torch.randn(rays, 3)

    def parameters(self):
        return [self.surface, self.features, *self.hidden, *self.along, *self.biases, self.out, self.out_bias]

    def radiance(self):
        phase = 2 * torch.pi * self.direction @ self.waves.T
        encoded = torch.cat((phase.sin(), phase.cos()), 1)
        read = F.embedding(self.hit, self.surface) + F.embedding(self.cell, self.features)
        x = F.relu(F.linear(encoded, self.along[0], self.biases[0]) + read[:, : self.width])
        for layer in range(1, self.layers):
            y = F.linear(x, self.hidden[layer - 1], self.biases[layer])
            if layer == self.again:
                y = y + F.linear(encoded, self.along[1]) + read[:, self.width :]
            x = F.relu(y)
        return F.linear(x, self.out, self.out_bias).relu().clamp(max=100)

    def both_ways(self):
        with torch.enable_grad():
            torch.autograd.grad(self.radiance(), self.parameters(), self.slope)


class Field:
    """The paper's radiance field along rays: 64 samples, 39-64-64-64-4, composited."""

    widths = (39, 64, 64, 64, 4)

    def __init__(self, rays, segments=64):
        self.points, self.directions = torch.randn(rays, 3), F.normalize(torch.randn(rays, 3))
        self.edges = torch.linspace(0, 8, segments + 1)
        self.octaves = 2.0 ** torch.arange(6)
        self.layers = [(torch.randn(o, i) / i**0.5, 0.1 * torch.randn(o)) for i, o in zip(self.widths, self.widths[1:])]

    def radiance(self):
        middle, length = (self.edges[1:] + self.edges[:-1]) / 2, self.edges[1:] - self.edges[:-1]
        x = self.points[:, None] + middle[:, None] * self.directions[:, None]
        phase = (x[..., None] * self.octaves).flatten(-2)
        x = torch.cat((x, phase.sin(), phase.cos()), -1)
        for weight, bias in self.layers:
            x = F.relu(F.linear(x, weight, bias))
        depth = x[..., 3] * length
        before = torch.exp(-(torch.cumsum(depth, 1) - depth))
        return ((before * (1 - torch.exp(-depth)))[..., None] * x[..., :3]).sum(1)


NETS = {
    "DenseNet121 forward, 320x240, batch 1": densenet_job(1),
    "DenseNet121 forward, 320x240, batch 4": densenet_job(4),
    "ResNet34 forward, 320x240, batch 1": resnet_job(1),
    "ResNet34 forward, 320x240, batch 4": resnet_job(4),
    "MGNet compact step, 160x120, batch 8": mgnet_job("compact", 8, 160, 128),
    "MGNet shared step, 160x120, batch 8": mgnet_job("shared", 8, 160, 128),
    "MGNet lite step, 160x120, batch 8": mgnet_job("lite", 8, 160, 128),
    "MGNet paper step, 320x240, batch 2": mgnet_job("paper", 2, 320, 256),
    "MGNet paper forward, 320x240, batch 1": mgnet_forward_job("paper", 1, 320, 256),
    "light compact step, 160x120, batch 8": None,
    "LightNet's MLP, paper, both ways": lambda _: LightMlp(4096).both_ways,
}
MLPS = {"in view, paper": lambda _: LightMlp(4096).radiance, "field, paper": lambda _: Field(4096).radiance}
FAMILIES = ("conv", "gemm", "mlp", "nets")


def wait():
    if torch.get_default_device().type == "cuda":
        torch.cuda.synchronize()


def timed(job, runs):
    job()
    seconds = []
    for _ in range(runs):
        wait()
        start = time.perf_counter()
        job()
        wait()
        seconds.append(time.perf_counter() - start)
    return seconds


def peer_rows(family, keys, runs):
    """(key, layout) -> runs, of the keys that have a peer."""
    rows = {}

    def add(key, layout, job):
        rows[(key, layout)] = timed(job, runs)

    for layout in LAYOUTS if family in ("conv", "nets") else LAYOUTS[:1]:
        if family == "conv":
            for shape in dict.fromkeys(key[0] for key in keys):
                for part, job in conv_jobs(shape, layout).items():
                    add((shape, part), layout, job)
            continue
        for key in keys:
            make = {"mlp": MLPS, "nets": NETS}.get(family, {}).get(key)
            if family == "gemm":
                add(key, layout, gemm_job(key, layout))
            elif make:
                add(key, layout, make(layout))
    return rows


class Family:
    """Runs of one family by program, gathered round by round."""

    def __init__(self, name, options):
        self.name, self.options = name, options
        self.runs, self.others = {"ours": {}, "before": {}, "peer": {}}, 0.0

    def round(self, runs):
        only = self.options.only if self.name == "nets" else ""
        with Load() as load:
            for program, binary in (("before", self.options.before), ("ours", self.options.binary)):
                if binary:
                    self.gather(program, our_rows(self.name, ours(binary, self.name, runs, only, self.options.device)))
            with torch.no_grad():
                self.gather("peer", peer_rows(self.name, list(self.runs["ours"]), runs))
        self.others = max(self.others, load.others)

    def gather(self, program, rows):
        for key, runs in rows.items():
            self.runs[program].setdefault(key, []).extend(runs)

    def medians(self, program):
        medians = {key: statistics.median(runs) for key, runs in self.runs[program].items()}
        if program != "peer":
            return medians
        best = {}
        for (key, _), seconds in medians.items():
            best[key] = min(seconds, best.get(key, seconds))
        return best

    def rows(self, program):
        """Seconds by the names of BARS; shapes are summed, which weighs them by FLOP."""
        medians = self.medians(program)
        if self.name == "gemm":
            return {"gemm": sum(medians.values())} if medians else {}
        if self.name != "conv":
            return medians
        sums = {}
        for (_, part), seconds in medians.items():
            name = "conv backward weights" if part == "weights" else "conv forward and backward data"
            sums[name] = sums.get(name, 0) + seconds
        return sums


def print_shapes(family):
    ours_, peer = family.medians("ours"), family.medians("peer")
    for key, seconds in ours_.items():
        if key in peer and family.name in ("conv", "gemm"):
            print(f"  {str(key):76} {1e3 * seconds:9.3f} ms {1e3 * peer[key]:9.3f} ms {seconds / peer[key]:6.2f}")


def report(family, wide, table):
    missed = []
    own, peer, before = (family.rows(program) for program in ("ours", "peer", "before"))
    busy = f"  busy: others took {100 * family.others:.0f} %" if family.others > 0.05 else ""
    for word, others, bars in (("RATIO", peer, BARS), ("BEFORE", before, BARS_BEFORE)):
        for name in own:
            if name not in others:
                continue
            ratio, bar = own[name] / others[name], bar_of(name, bars, wide)
            wanted = f"  bar {bar[0]} goal {bar[1]}" if bar else ""
            print(f"{word} {name} {ratio:.3f}{wanted}  ({1e3 * own[name]:.1f} ms, {1e3 * others[name]:.1f} ms){busy}", flush=True)
            if bar and ratio > bar[0]:
                missed.append(name)
            note = ", ".join(["missed"] * (name in missed) + ["busy"] * bool(busy))
            table.append((f"{name}, against the older one" if word == "BEFORE" else name, bar[0] if bar else "-",
                          bar[1] if bar else "-", f"{ratio:.2f}{f' ({note})' if note else ''}",
                          f"{1e3 * own[name]:.1f}", f"{1e3 * others[name]:.1f}"))
    return missed


def write_table(path, title, table):
    columns = ("what", "bar", "goal", "ours / other", "ours, ms", "other, ms")
    lines = [title, "", *(f"| {' | '.join(map(str, row))} |" for row in (columns, ["---"] * len(columns), *table))]
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="build/clerestory")
    parser.add_argument("--before", help="an older one that knows `bench nets`")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--only", default="", help="nets: rows whose name contains this")
    parser.add_argument("--runs", type=int, default=9, help="at least, of each program, in rounds of three")
    parser.add_argument("--shapes", action="store_true", help="a line for every shape too: ours, the peer's, ratio")
    parser.add_argument("--device", default="", help="ours runs on this OpenCL device")
    parser.add_argument("--peer-device", default="cpu", help="PyTorch's: cpu or cuda")
    parser.add_argument("--table", help="a file for the same as Markdown")
    options = parser.parse_args()
    torch.set_default_device(options.peer_device)
    torch.backends.cudnn.allow_tf32 = torch.backends.cuda.matmul.allow_tf32 = False
    device = ours(options.binary, "peak", 0, "", options.device)
    wide = device["float_width"] >= 16
    title = (
        f"{device['device']}, tile {device['tile']}, {device['peak_gflops']:.0f} GFLOP/s; PyTorch {torch.__version__} on "
        f"{options.peer_device}, {torch.get_num_threads()} threads; load {' '.join(f'{x:.2f}' for x in os.getloadavg())}"
    )
    print(title)
    each = min(3, options.runs)
    missed, table = [], []
    for name in options.families:
        family = Family(name, options)
        for _ in range(-(-options.runs // each)):
            family.round(each)
        if options.shapes:
            print_shapes(family)
        missed += report(family, wide, table)
    if options.table:
        write_table(options.table, title, table)
    if missed:
        print(f"missed: {', '.join(missed)}")
        sys.exit(1)


if __name__ == "__main__":
    main()
