"""Golden values of the light's networks, computed by PyTorch in double precision for tests/nets/in_view_test.cpp.

    python golden_light.py ../../tests/data/nets

Small nets of the paper's and of the compact structure; weights by golden_nets.py's formula.
"""
import math
import pathlib
import sys

import torch
from golden_nets import formula, some, write
from torch.nn.functional import batch_norm, conv2d, interpolate, linear, max_pool2d, relu, softplus

IMAGE = (2, 3, 20, 28)
ROWS, SAMPLES = 5, 16


class States:
    """Parameters by name, filled by the formula when they are first asked for; running statistics are those of inference."""

    def __init__(self):
        self.made = {}

    def __call__(self, name, *shape):
        if name not in self.made:
            u = formula(name, shape)
            if name.endswith("weight") and len(shape) == 4 and not (shape[0] == 1 and shape[2] * shape[3] == 1):
                u = (u * math.sqrt(24 / (shape[1] * shape[2] * shape[3]))).float().double()
            else:
                u = (1 if name.endswith("weight") else 0) + 0.25 * u
            self.made[name] = u.clone().requires_grad_()
        return self.made[name]


def conv_norm(s, conv, norm, x, out, kernel, stride):
    y = conv2d(x, s(conv + ".weight", out, x.shape[1], kernel, kernel), stride=stride, padding=kernel // 2)
    gamma, beta = s(norm + ".weight", 1, out, 1, 1).reshape(-1), s(norm + ".bias", 1, out, 1, 1).reshape(-1)
    return batch_norm(y, torch.zeros(out), torch.ones(out), gamma, beta, training=True)


def trunk(s, name, image, channels):
    """ResNet's first convolution and one basic block."""
    first = relu(conv_norm(s, name + ".conv1", name + ".bn1", image, channels, 7, 2))
    x = max_pool2d(first, 3, 2, 1)
    y = relu(conv_norm(s, name + ".layer1.0.conv1", name + ".layer1.0.bn1", x, channels, 3, 1))
    return [first, relu(x + conv_norm(s, name + ".layer1.0.conv2", name + ".layer1.0.bn2", y, channels, 3, 1))]


def fourier(s, name, x, frequencies):
    """x {..., c} -> {..., 2 m}."""
    b = s(name, frequencies, x.shape[-1], 1, 1).detach().reshape(frequencies, -1)
    waves = 2 * math.pi * x @ b.T
    return torch.cat([waves.sin(), waves.cos()], -1)


def rays(picture):
    """Pixels that rays hit, of a 20 x 28 picture (some miss), and unit directions."""
    hit = ((formula(f"hit{picture}", (ROWS, SAMPLES)) + 0.5) * 20 * 28).long()
    d = formula(f"direction{picture}", (3, ROWS, SAMPLES)).permute(1, 2, 0)
    return hit, d / d.norm(dim=-1, keepdim=True)


def in_view(width, layers, again, output, m=6, channels=5):
    s = States()
    image = formula("image", IMAGE) + 0.5
    maps = {k: formula(k, (2, c, 20, 28)) + 0.5 for k, c in (("albedo", 3), ("material", 3))}
    normal = formula("normal", (2, 3, 20, 28))
    levels = trunk(s, "encoder", torch.log1p(image) if output == "residual" else image, channels)
    levels[1] = interpolate(levels[1], levels[0].shape[2:], mode="bilinear", align_corners=True)
    features = torch.cat(levels, 1)
    albedo, rough, metal = maps["albedo"], maps["material"][:, :1], maps["material"][:, 1:2]
    diffuse, specular = albedo * (1 - metal), 0.04 + metal * (albedo - 0.04)
    results, total = {}, 0
    for n in range(2):
        hit, d = rays(n)
        row, column = hit // 28, hit % 28
        at = lambda t: t[n][:, row, column].permute(1, 2, 0)
        cell = features[n][:, torch.floor((row + 0.5) * 10 / 20).long(), torch.floor((column + 0.5) * 14 / 28).long()]
        parts = {
            "features": cell.permute(1, 2, 0),
            "surface": torch.cat(
                [
                    fourier(s, "frequencies." + k, at(v), m)
                    for k, v in (("normal", normal), ("diffuse", diffuse), ("specular", specular), ("roughness", rough))
                ],
                -1,
            ),
            "direction": fourier(s, "frequencies.direction", d, m),
        }
        x = None
        for layer in range(layers):
            given = {} if x is None else {"hidden": x}
            if layer == 0 or (again and layer == again):
                given |= parts
            matrix = torch.cat([s(f"mlp.{layer}.{k}.weight", width, v.shape[-1], 1, 1).reshape(width, -1) for k, v in given.items()], 1)
            bias = s(f"mlp.{layer}.bias", 1, width, 1, 1).reshape(-1)
            x = relu(linear(torch.cat(list(given.values()), -1), matrix, bias))
        f = linear(x, s("mlp.out.weight", 3, width, 1, 1).reshape(3, -1), s("mlp.out.bias", 1, 3, 1, 1).reshape(-1))
        if output == "residual":
            radiance = at(image) * torch.exp(torch.clamp(f, max=10))
        elif output == "released":
            radiance = torch.clamp(relu(f), max=100)
        elif output == "softplus":
            radiance = softplus(f)
        else:
            radiance = torch.exp(torch.clamp(f - 5, max=10))
        radiance = radiance.permute(2, 0, 1)
        results[f"radiance{n}"] = radiance
        total = total + (radiance * formula(f"cotangent{n}", (3, ROWS, SAMPLES))).sum()
    total.backward()
    return results | {"gradient." + k: some(v.grad, 200) for k, v in s.made.items() if v.grad is not None}


def leave_sphere(p, d, radius):
    b = (p * d).sum(-1)
    return -b + torch.sqrt(b * b - (p * p).sum(-1) + radius * radius)


def out_of_view(paper, stem=12, inner=10, rank=2, hidden=(7, 6), octaves=3, segments=9, channels=5):
    s = States()
    image = formula("image", IMAGE) + 0.5
    code = trunk(s, "encoder", image if paper else torch.log1p(image), channels)[-1].mean((2, 3))

    def dense(name, x, out):
        return linear(x, s(name + ".weight", out, x.shape[1], 1, 1).reshape(out, -1), s(name + ".bias", 1, out, 1, 1).reshape(-1))

    def stem_of(name):
        return relu(dense(name + "stem.1", relu(dense(name + "stem.0", code, stem)), stem))

    widths = [3 + 6 * octaves, *hidden, 4]
    weights, biases = [], []
    x = None if paper else stem_of("hyper.")
    for i, (n_in, n_out) in enumerate(zip(widths, widths[1:])):
        if paper:

            def written(kind, count):
                y = stem_of(f"hyper.{kind}.")
                for k in (0, 1):
                    y = relu(dense(f"hyper.{kind}.{i}.{k}", y, inner))
                return torch.nn.functional.leaky_relu(dense(f"hyper.{kind}.{i}.2", y, count), 0.1)

            weights.append(written("weights", n_out * n_in).reshape(2, n_out, n_in))
            biases.append(written("biases", n_out))
        else:
            name = f"hyper.layer{i}"
            numbers = dense(name + ".written", x, rank * (n_in + n_out) + n_out)
            tall = numbers[:, : rank * n_out].reshape(2, n_out, rank)
            wide = numbers[:, rank * n_out : rank * (n_in + n_out)].reshape(2, rank, n_in)
            weights.append(s(name + ".weight", n_out, n_in, 1, 1).reshape(n_out, n_in) + math.sqrt(2 / n_in / rank) * tall @ wide)
            biases.append(s(name + ".bias", 1, n_out, 1, 1).reshape(-1) + numbers[:, rank * (n_in + n_out) :])
    results, total = {}, 0
    scale, near, radius = 2.5, 0.05, 3.0
    for n in range(2):
        _, d = rays(n)
        p = (formula(f"point{n}", (3, ROWS, SAMPLES)).permute(1, 2, 0) * 4) / scale
        far = leave_sphere(p, d, radius)
        piece = (far - near) / segments
        t = near + (torch.arange(segments)[:, None, None] + 0.5) * piece
        length = torch.cat([t[1:] - t[:-1], (far - t[-1])[None]])
        x = p + t[..., None] * d
        octave = 2.0 ** torch.arange(octaves)
        waves = (x[..., None] * octave).flatten(-2)
        y = torch.cat([x, waves.sin(), waves.cos()], -1)
        for i in range(len(widths) - 1):
            y = linear(y, weights[i][n], biases[i][n])
            if paper or i + 2 < len(widths):
                y = relu(y)
        if not paper:
            y = softplus(y)
        depth = torch.cumsum(y[..., 3] * length, 0)
        before = torch.cat([torch.zeros_like(depth[:1]), depth[:-1]])
        share = torch.exp(-before) - torch.exp(-depth)
        radiance = (share[..., None] * y[..., :3]).sum(0).permute(2, 0, 1)
        results[f"radiance{n}"] = radiance
        total = total + (radiance * formula(f"cotangent{n}", (3, ROWS, SAMPLES))).sum()
    total.backward()
    return results | {"gradient." + k: some(v.grad, 200) for k, v in s.made.items() if v.grad is not None}


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    nets = {
        "in_view_residual": in_view(7, 3, 0, "residual"),
        "in_view_released": in_view(8, 4, 2, "released"),
        "in_view_softplus": in_view(6, 2, 0, "softplus"),
        "in_view_exp": in_view(6, 2, 1, "exp"),
        "out_of_view_paper": out_of_view(True),
        "out_of_view_low_rank": out_of_view(False),
    }
    tensors = {f"{net}.{name}": t for net, values in nets.items() for name, t in values.items()}
    write(target / "light.safetensors", tensors, {"torch": torch.__version__})
