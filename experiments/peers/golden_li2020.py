"""Golden values of the networks of Li et al. 2020, computed by PyTorch in double precision for tests/nets/li2020_test.cpp.

    python golden_li2020.py ../../tests/data/nets

Narrow nets on pictures whose halves are odd; weights by golden_nets.py's formula.
"""
import math
import pathlib
import sys

import torch
from golden_nets import formula, some, write
from torch.nn.functional import adaptive_avg_pool2d, conv2d, group_norm, interpolate, pad, relu

HEIGHT, WIDTH = 64, 84
MAPS = ((16, 32, 16, 32, 16, 32), (32, 16, 32, 16, 16, 16))
LIGHT = ((16, 16), (16, 32, 16, 32, 16, 32), (32, 16, 32, 16, 16, 16))
LOBES = 3


class States:
    """Parameters by name, filled by the formula when they are first asked for."""

    def __init__(self, dtype):
        self.made, self.dtype = {}, dtype

    def __call__(self, name, *shape):
        if name not in self.made:
            u = formula(name, shape)
            if name.endswith("weight") and not (shape[0] == 1 and shape[2] * shape[3] == 1):
                u = (u * math.sqrt(24 / (shape[1] * shape[2] * shape[3]))).float().double()
            else:
                u = (1 if name.endswith("weight") else 0) + 0.25 * u
            self.made[name] = u.to(self.dtype).clone().requires_grad_()
        return self.made[name]


def conv(s, name, x, out, kernel, stride, padding):
    return conv2d(x, s(name + ".weight", out, x.shape[1], kernel, kernel), s(name + ".bias", 1, out, 1, 1).reshape(-1), stride, padding)


def step(s, scope, prefix, name, x, out, kernel, stride, padding):
    y = conv(s, f"{scope}.{prefix}conv{name}", x, out, kernel, stride, padding)
    norm = f"{scope}.{prefix}gn{name}"
    return relu(group_norm(y, out // 16, s(norm + ".weight", 1, out, 1, 1).reshape(-1), s(norm + ".bias", 1, out, 1, 1).reshape(-1)))


def replicated(x):
    return pad(x, (1, 1, 1, 1), mode="replicate")


def encoder(s, scope, x, channels):
    levels = []
    for i in range(5):
        x = step(s, scope, "", i + 1, x if i else replicated(x), channels[i], 4, 2, 1 if i else 0)
        levels.append(x)
    return [*levels, step(s, scope, "", 6, x, channels[5], 3, 1, 1)]


def larger(x, size):
    return interpolate(x, size, mode="bilinear") if tuple(x.shape[2:]) != tuple(size) else x


def decoder(s, scope, levels, channels, out, size):
    x = step(s, scope, "d", 1, levels[5], channels[0], 3, 1, 1)
    for i in range(1, 6):
        x = interpolate(torch.cat([x, levels[5 - i]], 1), scale_factor=2, mode="bilinear")
        x = step(s, scope, "d", i + 1, x, channels[i], 3, 1, 1)
        x = larger(x, size if i == 5 else levels[4 - i].shape[2:])
    return conv(s, scope + ".dconvFinal", replicated(x), out, 3, 1, 0)


def maps_of(s, image):
    levels = encoder(s, "encoder", image, MAPS[0])
    said = lambda name: torch.clamp(1.01 * torch.tanh(decoder(s, name, levels, MAPS[1], 3, image.shape[2:])), -1, 1)
    normal = said("decoder_normal")
    return {
        "albedo": 0.5 * (said("decoder_albedo") + 1),
        "normal": normal / torch.clamp(normal.norm(dim=1, keepdim=True), min=1e-6),
        "rough": said("decoder_material").mean(1, keepdim=True),
        "depth": 0.5 * (said("decoder_depth").mean(1, keepdim=True) + 1),
    }


def third(x):
    return x / x.mean((1, 2, 3), keepdim=True) / 3


def lobes_of(s, image, maps):
    m = {k: v.detach() for k, v in maps.items()}
    x = torch.cat([image, third(m["albedo"]), 0.5 * (m["normal"] + 1), 0.5 * (m["rough"] + 1), third(m["depth"])], 1)
    x = interpolate(x, (2 * HEIGHT, 2 * WIDTH), mode="bilinear")
    x = step(s, "light.encoder", "", "01", replicated(x), LIGHT[0][0], 4, 2, 0)
    x = step(s, "light.encoder", "", "02", x, LIGHT[0][1], 4, 2, 1)
    levels = encoder(s, "light.encoder", x, LIGHT[1])
    said = lambda name, out: 1.01 * torch.tanh(decoder(s, name, levels, LIGHT[2], out, (HEIGHT // 2, WIDTH // 2)))
    unit = lambda x: torch.clamp(0.5 * (x + 1), 0, 1)
    axis = said("light.decoder_axis", 3 * LOBES).reshape(2, LOBES, 3, HEIGHT // 2, WIDTH // 2)
    axis = axis / torch.clamp(axis.norm(dim=2, keepdim=True), min=1e-6)
    return {"axis": axis.flatten(1, 2), "sharpness": unit(said("light.decoder_sharpness", LOBES)), "weight": unit(said("light.decoder_weight", 3 * LOBES))}


def environment(lobes):
    """Radiance along the 8 x 16 directions above each cell of the first picture: {3, cells, 128}."""
    el = (torch.arange(8) + 0.5) / 8 * math.pi / 2
    az = ((torch.arange(16) + 0.5) / 16 - 0.5) * 2 * math.pi
    el, az = torch.meshgrid(el, az, indexing="ij")
    d = torch.stack([el.sin() * az.cos(), el.sin() * az.sin(), el.cos()], -1).reshape(128, 3)
    stretched = lambda x: torch.tan(0.5 * math.pi * 0.999 * x[0])
    axis = lobes["axis"][0].reshape(LOBES, 3, -1)
    sharp, weight = stretched(lobes["sharpness"]).reshape(LOBES, -1), stretched(lobes["weight"]).reshape(LOBES, 3, -1)
    cosine = torch.einsum("kcp,sc->kps", axis, d)
    return torch.einsum("kcp,kps->cps", weight, torch.exp(sharp[..., None] * (cosine - 1)))


def in_camera_space(axis, normal):
    """Axes {2, 3 K, h, w} out of the frame of the hemisphere above the mean normal of each cell."""
    n = adaptive_avg_pool2d(normal, axis.shape[2:])
    n = n / n.norm(dim=1, keepdim=True)
    nearly_up = n[:, 1:2].abs() > 0.999  # ours: theirs has a frame of no direction there
    up = torch.cat([torch.zeros_like(nearly_up), ~nearly_up, nearly_up], 1).to(n.dtype)
    y = up - (up * n).sum(1, keepdim=True) * n
    y = y / y.norm(dim=1, keepdim=True)
    x = -torch.linalg.cross(y, n, dim=1)
    frame = torch.stack([x / x.norm(dim=1, keepdim=True), y, n], 1)
    return torch.einsum("nachw,nkahw->nkchw", frame, axis.unflatten(1, (LOBES, 3))).flatten(1, 2)


def run(dtype):
    s = States(dtype)
    image = (formula("image", (2, 3, HEIGHT, WIDTH)) + 0.5).to(dtype)
    maps = maps_of(s, image)
    lobes = lobes_of(s, image, maps)
    total = sum((v * formula("cotangent." + k, tuple(v.shape)).to(dtype)).sum() for k, v in (maps | lobes).items())
    total.backward()
    results = {k: some(v, 512) for k, v in (maps | lobes).items()}
    results |= {"gradient." + k: some(v.grad, 103) for k, v in s.made.items() if v.grad is not None}
    return results, lobes, maps


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    tensors, lobes, maps = run(torch.float64)
    with torch.no_grad():
        camera_axis = in_camera_space(lobes["axis"], maps["normal"])
        tensors |= {"environment": some(environment(lobes), 2048), "camera_axis": some(camera_axis, 512)}
    single, _, _ = run(torch.float32)
    error = lambda kind: max(
        float((single[k].double() - v).norm() / v.norm()) for k, v in tensors.items() if k in single and k.startswith("gradient") == (kind == "gradient")
    )
    facts = {"torch": torch.__version__, "float_error_value": repr(error("value")), "float_error_gradient": repr(error("gradient"))}
    write(target / "li2020.safetensors", tensors, facts)
