"""The Monte Carlo layer as a vectorised PyTorch program, beside ours: the same samples, the same march, in turns.

    python3 experiments/peers/torch_layer.py --binary build/clerestory

Needs torch, torchvision and safetensors. `clerestory bench layer --write` gives the scene, and the picture and gradients that
they are compared with first: root mean square of differences over that of ours, at most 1e-4 in double, beside those in
float, in which a ray in some ten thousand meets another cell. Then both run in turns: 64 samples a pixel, forward and
adjoint for albedo, normal, roughness, metallic and the map of radiance. The peer's random numbers are made beforehand, and it
takes blocks of pixels of the size that is fastest here. With LightNet (compact, random weights) rays that are asked for
go through its MLP and its field, forward alone, as ours do; its encoders are left out of the peer.

Prints `AGREE <what> <precision> <error>` and `RATIO <name> <our time / peer's time> bar <most>`, marked `busy` where another
process took over 5 % of the cores meanwhile. Exit 1 when a bar is missed.
"""
import argparse
import os
import statistics
import sys
import tempfile
import time

import numpy as np
import torch
import torch.nn.functional as F
from layer_runs import layer_runs
from load import Load
from safetensors import safe_open
from safetensors.torch import load_file
from torch_nets import Field, LightMlp

AGREE_BAR, GIVEN_BAR, LEARNED_BAR = 1e-4, 1 / 20, 1 / 4
BLOCKS = (4096, 16384)  # pixels that the peer takes at once: the fastest of them
SALT = 0x62726466
COSINE_SHARE, LEAST_ALPHA = 0.1, 1e-4
LEAST_SHARE = 1e-3  # of a part of the learned light


def random4(seed, pixels, samples):
    """kernels/lib/rng.clh, random4 of block 0: {4, pixels, samples} in [0, 1)."""
    shape = (pixels, samples)
    x = np.full(shape, seed ^ SALT, np.uint32)
    y = np.broadcast_to(np.arange(pixels, dtype=np.uint32)[:, None], shape)
    z = np.broadcast_to(np.arange(samples, dtype=np.uint32), shape)
    x, y, z, w = (v * np.uint32(1664525) + np.uint32(1013904223) for v in (x, y, z, np.zeros(shape, np.uint32)))
    for once in (True, False):
        x += y * w
        y += z * x
        z += x * y
        w += y * z
        if once:
            x, y, z, w = (v ^ v >> 16 for v in (x, y, z, w))
    return np.stack([(v >> 8).astype(np.float32) * np.float32(2**-24) for v in (x, y, z, w)])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def luminance(c):
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]


def frame_of(n):
    """Tangents of unit normals (Duff et al. 2017)."""
    s = torch.where(n[2] < 0, -1.0, 1.0).to(n)
    a = -1 / (s + n[2])
    b = n[0] * n[1] * a
    t = torch.stack((1 + s * n[0] ** 2 * a, s * b, -s * n[0]))
    return t, torch.stack((b, s + n[1] ** 2 * a, -n[1]))


def to_local(frame, v):
    return torch.stack([dot(axis, v) for axis in frame])


def to_world(frame, v):
    return frame[0] * v[0] + frame[1] * v[1] + frame[2] * v[2]


def smith_t(c, a2):
    return torch.sqrt(a2 + (1 - a2) * c * c)


def ggx_d(h, alpha):
    across, along = h[0] ** 2 + h[1] ** 2, h[2] ** 2
    k = alpha * (across + along) / (across + alpha**2 * along)
    return k * k / torch.pi


def schlick(f0, share):
    return f0 + (1 - f0) * share


class Material:
    """Of pixels, {C, pixels, 1}."""

    def __init__(self, albedo, roughness, metallic):
        self.alpha = torch.clamp(roughness**2, min=LEAST_ALPHA)
        self.f0 = 0.04 + (albedo - 0.04) * metallic
        self.diffuse = albedo * (1 - metallic)


def draw(material, wo, u):
    """Directions in the local frame by visible normals (spherical caps) or the cosine lobe, and their density."""
    s = luminance(schlick(material.f0, (1 - wo[2]).clamp(min=0) ** 5)).clamp(min=0.01)
    chance = (s / (s + luminance(material.diffuse).clamp(min=0.01))).clamp(max=1 - COSINE_SHARE)
    alpha, angle = material.alpha, 2 * torch.pi * u[1]
    cosine, sine = angle.cos(), angle.sin()
    # The half vector of a view w stretched to the sphere and a direction c of its cap.
    w = F.normalize(torch.stack((alpha * wo[0], alpha * wo[1], wo[2])), dim=0)
    cz = (1 - u[0]) - u[0] * w[2]
    r = torch.sqrt((1 - cz * cz).clamp(min=0))
    level = torch.sqrt(wo[0] ** 2 + wo[1] ** 2)
    seen = level > 0
    ax, ay = torch.where(seen, wo[0] / level, 1.0), torch.where(seen, wo[1] / level, 0.0)
    # Angles count from against the view.
    cx, cy = -r * (cosine * ax - sine * ay), -r * (cosine * ay + sine * ax)
    m = torch.stack((alpha * (cx + w[0]), alpha * (cy + w[1]), cz + w[2]))
    h = (2 * dot(wo, m) / dot(m, m)) * m
    radius = torch.sqrt(u[0])
    lobe = torch.stack((-radius * (cosine * ax - sine * ay), -radius * (cosine * ay + sine * ax), torch.sqrt(1 - u[0])))
    wi = torch.where(u[2] >= chance, lobe, h - wo)
    h = wi + wo
    specular = ggx_d(h, alpha) * 0.5 / (wo[2] + smith_t(wo[2], alpha**2))
    return wi, chance * specular + (1 - chance) * wi[2] / torch.pi


def brdf_times_cosine(material, frame, wo, wi, h):
    """Directions of the camera's frame, of no gradient, around a frame that has one."""
    ci, co, half = dot(frame[2], wi), dot(frame[2], wo), to_local(frame, h)
    a2 = material.alpha**2
    v = 0.5 / (ci * smith_t(co, a2) + co * smith_t(ci, a2))
    apart, whole = wi - wo, wi + wo
    share = (dot(apart, apart) / (4 + 2 * torch.sqrt(dot(whole, whole)))) ** 5
    lobe = ggx_d(half, material.alpha) * v * ci
    return schlick(material.f0, share) * lobe + material.diffuse * (ci / torch.pi)


class Scene:
    def __init__(self, path, dtype):
        tensors = load_file(path)
        for name, tensor in tensors.items():
            setattr(self, name.replace(" ", "_"), tensor.to(dtype))
        with safe_open(path, "pt") as file:
            self.samples, seed = int(file.metadata()["samples"]), int(file.metadata()["seed"])
        self.dtype = dtype
        self.height, self.width = self.depth.shape[1:]
        self.pixels = self.height * self.width
        self.numbers = torch.from_numpy(random4(seed, self.pixels, self.samples)).to(dtype)
        self.fx, self.fy, self.cx, self.cy = (float(x) for x in self.camera)
        self.wrt = {
            "albedo": self.albedo.reshape(3, -1),
            "normal": self.normal.reshape(3, -1),
            "roughness": self.material[0].reshape(1, -1),
            "metallic": self.material[1].reshape(1, -1),
            "radiance": self.photo.reshape(3, -1).T.contiguous(),
        }
        self.target = self.photo.reshape(3, -1)
        self.weight = 2 / (self.target**2 + 0.01) / (3 * self.pixels)
        y, x = torch.meshgrid(torch.arange(self.height) + 0.5, torch.arange(self.width) + 0.5, indexing="ij")
        rays = torch.stack(((x - self.cx) / self.fx, (self.cy - y) / self.fy, -torch.ones_like(x)))
        self.rays = rays.reshape(3, -1).to(dtype)
        self.k = 1 / self.depth.reshape(-1)
        self.facing = self.normal.reshape(3, -1).T.contiguous()


def clip(f, g, t0, t1):
    """What of [t0, t1] has f + t g >= 0."""
    t = -f / g
    t0 = torch.where((g > 0) & (f < 0), torch.maximum(t0, t), t0)
    t1 = torch.where(g < 0, torch.minimum(t1, t), t1)
    return t0, torch.where((g == 0) & (f < 0), -1.0, t1)


def axis_of(a, b):
    slope = b - a
    back = slope < 0
    start, slope = torch.where(back, -a, a), slope.abs()
    slope = torch.where(slope < 1e-30, 0.0, slope)
    reciprocal = torch.where(slope == 0, 1e30, 1 / slope)
    nearest = torch.round(start).to(torch.int64)
    cell = nearest - ((nearest - start) * reciprocal > 0).to(torch.int64)
    return start, reciprocal, cell, -back.to(torch.int64)


def march(scene, own, origin, direction):
    """Cell by cell: the pixel that each ray of a list meets, or -1, and its uncertainty. own {rays}, others {3, rays}."""
    (ox, oy, oz), (dx, dy, dz) = origin, direction
    om, dm = -oz, -dz
    w, h, fx, fy, cx, cy = scene.width, scene.height, scene.fx, scene.fy, scene.cx, scene.cy
    far = torch.finfo(om.dtype).max
    t0, t1 = torch.zeros_like(om), torch.full_like(om, far)
    for f, g in (
        (om - 0.5 * float(scene.range[1]), dm),
        (cx * om + fx * ox, cx * dm + fx * dx),
        ((w - cx) * om - fx * ox, (w - cx) * dm - fx * dx),
        (cy * om - fy * oy, cy * dm - fy * dy),
        ((h - cy) * om + fy * oy, (h - cy) * dm + fy * dy),
    ):
        t0, t1 = clip(f, g, t0, t1)
    endless = t1 >= far
    t1_at = torch.where(endless, 0.0, t1)
    am, bm = om + t0 * dm, torch.where(endless, dm, om + t1_at * dm)
    bx, by = torch.where(endless, dx, ox + t1_at * dx), torch.where(endless, dy, oy + t1_at * dy)
    x0, xr, i, flip_x = axis_of((cx + fx * (ox + t0 * dx) / am).clamp(0, w), (cx + fx * bx / bm).clamp(0, w))
    y0, yr, j, flip_y = axis_of((cy - fy * (oy + t0 * dy) / am).clamp(0, h), (cy - fy * by / bm).clamp(0, h))
    k0 = 1 / am
    slope = torch.where(endless, 0.0, 1 / bm) - k0

    pixel = torch.full_like(own, -1)
    uncertain = torch.ones_like(om)
    inside = lambda i, j, fx_, fy_: (i ^ fx_ >= 0) & (i ^ fx_ < w) & (j ^ fy_ >= 0) & (j ^ fy_ < h)
    where = torch.arange(len(own))[(t0 < t1) & inside(i, j, flip_x, flip_y)]
    x0, xr, i, flip_x, y0, yr, j, flip_y, k0, slope = (v[where] for v in (x0, xr, i, flip_x, y0, yr, j, flip_y, k0, slope))
    s = torch.zeros_like(k0)
    active = torch.ones_like(where, dtype=torch.bool)
    while len(where):
        sx, sy = (i + 1 - x0) * xr, (j + 1 - y0) * yr
        leave = torch.minimum(sx, sy).clamp(max=1)
        cell = torch.where(active, (j ^ flip_y) * w + (i ^ flip_x), 0)
        k_in, k_out, k_cell = k0 + s * slope, k0 + leave * slope, scene.k[cell]
        met = (active & (torch.minimum(k_in, k_out) <= k_cell)).nonzero()[:, 0]
        if len(met):
            ray, at = where[met], cell[met]
            hit = (at != own[ray]) & ((scene.facing[at] * direction[:, ray].T).sum(1) <= 0)
            met, ray, at = met[hit], ray[hit], at[hit]
            pixel[ray] = at
            behind = (1 / k_in[met] - 1 / k_cell[met]) / float(scene.range[0])
            uncertain[ray] = torch.tanh(10 * behind.clamp(min=0))
            active[met] = False
        i, j, s = i + (sx <= leave).to(i), j + (sy <= leave).to(j), leave
        active &= (s < 1) & inside(i, j, flip_x, flip_y)
        if int(active.sum()) < 0.75 * len(where):
            where, x0, xr, i, flip_x, y0, yr, j, flip_y, k0, slope, s = (
                v[active] for v in (where, x0, xr, i, flip_x, y0, yr, j, flip_y, k0, slope, s)
            )
            active = torch.ones_like(where, dtype=torch.bool)
    return pixel, uncertain


class CompactMlp(LightMlp):
    width, frequencies, layers, again = 128, 32, 4, 0


class CompactField(Field):
    widths = (39, 32, 32, 4)


class Nets:
    """Radiance along a list of rays, each part where it has a share of them."""

    def __init__(self, scene):
        self.width = scene.width
        self.mlp, self.field = CompactMlp(1, scene.height, scene.width), CompactField(1, 32)

    def __call__(self, pixel, direction, origin, u):
        mlp, field = self.mlp, self.field
        near, far = torch.zeros(len(pixel), 3), torch.zeros(len(pixel), 3)
        sure, unsure = (1 - u > LEAST_SHARE).nonzero()[:, 0], (u > LEAST_SHARE).nonzero()[:, 0]
        mlp.direction, mlp.hit = direction[:, sure].T, pixel[sure]
        mlp.cell = mlp.hit // self.width // 2 * (self.width // 2) + mlp.hit % self.width // 2
        near[sure] = mlp.radiance()
        field.points, field.directions = origin[:, unsure].T, direction[:, unsure].T
        far[unsure] = field.radiance()
        return (1 - u)[:, None] * near + u[:, None] * far


class Layer:
    """One run: picture and gradients of the loss mean((I - P)^2 / (P^2 + 0.01))."""

    def __init__(self, scene, block, nets=None):
        self.scene, self.block, self.nets = scene, block, nets
        self.leaves = {k: v.detach().requires_grad_() for k, v in scene.wrt.items()}

    def run(self):
        for leaf in self.leaves.values():
            leaf.grad = None
        return torch.cat([self.of_pixels(p, min(p + self.block, self.scene.pixels)) for p in range(0, self.scene.pixels, self.block)], 1)

    def of_pixels(self, first, end):
        scene, leaves = self.scene, self.leaves
        maps = {k: leaves[k][:, first:end, None] for k in ("albedo", "normal", "roughness", "metallic")}
        material = Material(maps["albedo"], maps["roughness"][0], maps["metallic"][0])
        n = F.normalize(maps["normal"], dim=0)
        frame = (*frame_of(n), n)
        with torch.no_grad():
            ray = scene.rays[:, first:end, None]
            view = F.normalize(-ray, dim=0)
            wi, pdf = draw(material, to_local(frame, view), scene.numbers[:, first:end])
            towards = to_world(frame, wi)
            drawn = (wi[2] > 0) & (dot(n, view) > 0)
            origin = (scene.depth.reshape(-1)[first:end, None] * ray).expand_as(towards)
            own = torch.arange(first, end)[:, None].expand(-1, scene.samples)[drawn]
            direction, start = towards[:, drawn], origin[:, drawn]
            pixel, u = march(scene, own, start, direction)
            half = towards + view
            learned = self.nets(pixel.clamp(min=0), direction, start, u) if self.nets else None
        f = brdf_times_cosine(material, frame, view, towards, half)
        weight = torch.where(drawn, f / pdf, 0.0)
        if learned is None:
            seen = F.embedding(pixel.clamp(min=0), leaves["radiance"])
            learned = torch.where((pixel < 0)[:, None], scene.ambient, (1 - u)[:, None] * seen + u[:, None] * scene.ambient)
        radiance = torch.zeros_like(weight).masked_scatter(drawn, learned.T)
        picture = (weight * radiance).sum(2) / scene.samples
        slope = (picture.detach() - scene.target[:, first:end]) * scene.weight[:, first:end]
        picture.backward(slope)
        return picture.detach()

    def results(self):
        picture = self.run()
        grads = {k: v.grad for k, v in self.leaves.items()}
        return {"picture": picture, **grads, "radiance": grads["radiance"].T}


def apart(found, wanted):
    return float((found - wanted.reshape(found.shape)).norm() / wanted.norm())


def agree(path):
    """Whether the bar is met."""
    good = True
    for precision, dtype in (("double", torch.float64), ("float", torch.float32)):
        scene = Scene(path, dtype)
        if not hasattr(scene, f"{precision}_picture"):
            print(f"AGREE: this device has no {precision}")
            continue
        for what, found in Layer(scene, 4096).results().items():
            error = apart(found, getattr(scene, f"{precision}_{what}"))
            missed = precision == "double" and not error <= AGREE_BAR
            good = good and not missed
            print(f"AGREE {what} {precision} {error:.2g}{'  missed' if missed else ''}", flush=True)
    return good


def seconds_of(layer):
    start = time.perf_counter()
    layer.run()
    return time.perf_counter() - start


def compared(options, name, bar, layers):
    """Rounds of both; whether the bar is met."""
    with Load() as load:
        first = {block: seconds_of(layer) for block, layer in layers.items()}
        layer = layers[min(first, key=first.get)]
        own, peer = [], []
        for _ in range(options.rounds):
            own += layer_runs(options.binary, name, 3)
            peer.append(seconds_of(layer))
    mine, theirs = statistics.median(own), statistics.median(peer)
    busy = f"  busy: others took {100 * load.others:.0f} %" if load.others > 0.05 else ""
    met = mine / theirs <= bar
    print(
        f"RATIO {name} {mine / theirs:.4f}  bar {bar:.4f}  ({1e3 * mine:.0f} ms, {1e3 * theirs:.0f} ms in blocks of {layer.block})"
        f"{busy}{'' if met else '  missed'}",
        flush=True,
    )
    return met


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="build/clerestory")
    parser.add_argument("--rounds", type=int, default=3, help="of each program: three runs of ours, one of the peer's")
    parser.add_argument("--lights", nargs="+", choices=["given", "learned"], default=["given", "learned"])
    options = parser.parse_args()
    given, learned = ("%s, gradients, 160x120, 64 samples" % light for light in ("given", "learned"))
    with tempfile.TemporaryDirectory() as folder:
        layer_runs(options.binary, given, 1, f"--write={folder}")
        path = os.path.join(folder, "layer.safetensors")
        good = [agree(path)] if "given" in options.lights else []
        scene = Scene(path, torch.float32)
    print(f"PyTorch {torch.__version__}, {torch.get_num_threads()} threads; load {os.getloadavg()[0]:.2f}")
    if "given" in options.lights:
        good.append(compared(options, given, GIVEN_BAR, {b: Layer(scene, b) for b in BLOCKS}))
    if "learned" in options.lights:
        nets = Nets(scene)
        good.append(compared(options, learned, LEARNED_BAR, {b: Layer(scene, b, nets) for b in BLOCKS}))
    if not all(good):
        sys.exit(1)


if __name__ == "__main__":
    main()
