"""Golden values of DenseNet121, MGNet, VGG16 and ResNet34, also as imported, computed by PyTorch in double precision for tests/nets.

    python golden_nets.py ../../tests/data/nets

Weights, inputs and cotangents come from a formula (`formula` here, tests/nets/golden.cpp there), so that only results are
stored. Needs torch and torchvision.
"""
import json
import math
import pathlib
import struct
import sys

import torch
import torchvision
from mgnet_torch import Encoder, MGNet, losses

torch.set_default_dtype(torch.float64)


def formula(name, shape):
    """Numbers in [-0.5, 0.5), exact in float: 24 bits of a hash of (name, index)."""
    h = 2166136261
    for byte in name.encode():
        h = ((h ^ byte) * 16777619) % 2**32
    i = torch.arange(math.prod(shape), dtype=torch.int64)
    z = (h + i * 2654435761) % 2**32
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        z = ((z ^ (z >> shift)) * factor) % 2**32
    z = z ^ (z >> 16)
    return ((z >> 8).double() / 2**24 - 0.5).reshape(shape)


def fill(net):
    with torch.no_grad():
        for name, p in net.named_parameters():
            u = formula(name, tuple(p.shape))
            if name.startswith("scale"):
                p.copy_(u)
            elif p.dim() == 4:
                fan_in = p.shape[1] * p.shape[2] * p.shape[3]
                p.copy_((u * math.sqrt(24 / fan_in)).float().double())
            else:
                norm_weight = name.endswith("weight")  # what else is no convolution
                p.copy_(((1 if norm_weight else 0) + 0.25 * u))


def write(path, tensors, metadata):
    header, at = {"__metadata__": metadata}, 0
    blobs = []
    for name in sorted(tensors):
        t = tensors[name].detach().float().contiguous()
        size = t.numel() * 4
        header[name] = {"dtype": "F32", "shape": list(t.shape), "data_offsets": [at, at + size]}
        blobs.append(t.numpy().tobytes())
        at += size
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + b"".join(blobs))
    print(path, 8 + len(text) + at, "bytes")


def some(t, most=600):
    """The whole tensor, or `most` elements spread over it evenly."""
    flat = t.detach().reshape(-1)
    if flat.numel() <= most:
        return flat
    return flat[torch.arange(most) * (flat.numel() // most)]


def densenet_results(dtype):
    net = Encoder(32, 64)
    fill(net)
    net = net.to(dtype)
    image = (formula("image", (2, 3, 32, 32)) + 0.5).to(dtype).requires_grad_()
    levels = net(image)
    total = sum((x * formula(f"cotangent{i}", tuple(x.shape)).to(dtype)).sum() for i, x in enumerate(levels))
    total.backward()
    tensors = {f"level{i}": some(x, 4096) for i, x in enumerate(levels)}
    tensors["gradient.image"] = image.grad
    for name, p in net.named_parameters():
        if any(part in name for part in ("conv0", "norm0", "transition", "norm5", "denselayer1.", "denselayer16.", "denselayer24.")):
            tensors["gradient." + name] = some(p.grad)
    for name, b in net.named_buffers():
        if name.endswith(("running_mean", "running_var")) and ("norm0" in name or "denseblock3.denselayer24" in name or "norm5" in name):
            tensors["state." + name] = some(b)
    net.eval()
    for i, x in enumerate(net(image)):
        tensors[f"inference{i}"] = some(x, 1024)
    return tensors


def float_errors(tensors, in_float):
    """Relative errors (Euclidean norm, worst tensor of a kind) of PyTorch's own float run, as a yardstick."""
    errors = {}
    for name, t in tensors.items():
        kind = name.split(".")[0].rstrip("01234")
        errors[kind] = max(errors.get(kind, 0), float((in_float[name].double() - t).norm() / t.norm()))
    return {f"float_error_{kind}": repr(e) for kind, e in errors.items()}


def densenet(folder):
    tensors = densenet_results(torch.float64)
    metadata = float_errors(tensors, densenet_results(torch.float32))
    write(folder / "densenet121.safetensors", tensors, {"torch": torch.__version__, "size": "2x3x32x32", **metadata})


def resnet_results(dtype):
    net = torchvision.models.resnet34(weights=None)
    fill(net)
    net = net.to(dtype)

    def levels_of(image):
        levels = [net.relu(net.bn1(net.conv1(image)))]
        x = net.maxpool(levels[0])
        for stage in (net.layer1, net.layer2, net.layer3, net.layer4):
            x = stage(x)
            levels.append(x)
        return levels

    image = (formula("image", (2, 3, 36, 44)) + 0.5).to(dtype).requires_grad_()
    levels = levels_of(image)
    sum((x * formula(f"cotangent{i}", tuple(x.shape)).to(dtype)).sum() for i, x in enumerate(levels)).backward()
    tensors = {f"level{i}": some(x, 2048) for i, x in enumerate(levels)}
    tensors["gradient.image"] = some(image.grad, 2048)
    for name, p in net.named_parameters():
        if p.grad is not None and any(part in name for part in ("layer1.0.", "downsample", "layer3.5.", "layer4.2.")) or name in ("conv1.weight", "bn1.bias"):
            tensors["gradient." + name] = some(p.grad, 300)
    for name, b in net.named_buffers():
        if name.endswith(("running_mean", "running_var")) and name.startswith(("bn1", "layer4.2.bn2")):
            tensors["state." + name] = some(b)
    net.eval()
    for i, x in enumerate(levels_of(image)):
        tensors[f"inference{i}"] = some(x, 512)
    return tensors


def resnet(folder):
    tensors = resnet_results(torch.float64)
    metadata = float_errors(tensors, resnet_results(torch.float32))
    write(folder / "resnet34.safetensors", tensors, {"torch": torch.__version__, "size": "2x3x36x44", **metadata})


def mgnet(folder, preset):
    net = MGNet(preset)
    fill(net)
    n, h, w = 2, 40, 56  # 5x7 at 1/8: sizes that disagree with the skips'
    names = {"image": 3, "albedo": 3, "material": 2, "normal": 3, "depth": 1}
    batch = {k: formula(k, (n, c, h, w)) + 0.5 for k, c in names.items()}
    batch["normal"] = batch["normal"] - 0.5
    for mask in ("albedo_mask", "geometry_mask", "material_mask"):
        batch[mask] = (formula(mask, (n, 1, h, w)) > -0.2).double()
    batch["log_scale"] = formula("log_scale", (n, 1, 1, 1)) + 1.5
    batch["scale_mask"] = torch.ones(n, 1, 1, 1)
    maps = net(batch["image"])
    terms = losses(maps, batch)
    terms["loss"].backward()
    tensors = {f"map.{k}": some(v, 2048) for k, v in maps.items()}
    tensors |= {f"loss.{k}": v.reshape(1) for k, v in terms.items()}
    for name, p in net.named_parameters():
        if any(part in name for part in ("conv0", "norm0", "norm5", "decoder", "scale", "denseblock2.denselayer7.", "transition3", "stem", "stage2", "stage6")):
            tensors["gradient." + name] = some(p.grad, 150)
    write(folder / f"mgnet_{preset}.safetensors", tensors, {"torch": torch.__version__, "size": f"{n}x3x{h}x{w}"})


def normalised(picture):
    """As ImageNet's pictures are given to torchvision's nets."""
    mean, deviation = (torch.tensor(v, dtype=picture.dtype).reshape(1, 3, 1, 1) for v in ((0.485, 0.456, 0.406), (0.229, 0.224, 0.225)))
    return (picture - mean) / deviation


def display_coded(radiance):
    return (radiance + 1e-3) ** (1 / 2.2)


def encoder_levels(net):
    """Features of torchvision's nets at the levels that nets/densenet.hpp, resnet.hpp and vgg.hpp name."""

    def densenet_levels(f, x):
        levels = [f.relu0(f.norm0(f.conv0(x)))]  # no pooling here, as in the paper
        for k in (1, 2, 3):
            levels.append(getattr(f, f"transition{k}")(getattr(f, f"denseblock{k}")(levels[-1])))
        return [*levels, f.norm5(f.denseblock4(levels[-1]))]

    def resnet_levels(x):
        levels = [net.relu(net.bn1(net.conv1(x)))]
        x = net.maxpool(levels[0])
        for stage in (net.layer1, net.layer2, net.layer3, net.layer4):
            x = stage(x)
            levels.append(x)
        return levels

    if isinstance(net, torchvision.models.DenseNet):
        return lambda image: densenet_levels(net.features, normalised(display_coded(image)))
    if isinstance(net, torchvision.models.ResNet):
        return lambda image: resnet_levels(normalised(display_coded(image)))
    return lambda image: [net.features[:16](normalised(image))]


def learned(name, shape):
    """A tensor of a state dictionary as it might have been learned elsewhere, exact in float."""
    u = formula(name, shape)
    if len(shape) == 4:
        u = u * math.sqrt(24 / math.prod(shape[1:]))
    elif name.endswith("running_var"):
        u = 1 + 0.5 * u
    elif name.endswith("weight") and len(shape) == 1:
        u = 1 + 0.25 * u
    else:
        u = 0.25 * u
    return u.float().double()


def imported(folder):
    """Features of whole nets of torchvision, whose state dictionaries `clerestory weights import` takes."""
    tensors, metadata = {}, {"torch": torch.__version__, "size": "1x3x48x64"}
    image = formula("image", (1, 3, 48, 64)) + 0.5
    for name in ("densenet121", "resnet34", "vgg16"):
        with torch.device("meta"):  # what nobody reads takes no memory
            net = getattr(torchvision.models, name)(weights=None).eval()
        shapes = {key: list(t.shape) for key, t in net.state_dict().items()}
        for key, shape in shapes.items():
            if not key.startswith(("classifier", "fc")) and not key.endswith("num_batches_tracked"):
                net.load_state_dict({key: learned(f"{name}.{key}", tuple(shape))}, strict=False, assign=True)
        with torch.no_grad():
            exact = encoder_levels(net)(image)
            single = encoder_levels(net.float())(image.float())
        own = {f"{name}.level{i}": some(x, 512) for i, x in enumerate(exact)}
        errors = [float((s.double() - x).norm() / x.norm()) for s, x in zip(single, exact)]
        metadata |= {f"shapes_{name}": json.dumps(shapes, separators=(",", ":")), f"float_error_{name}": repr(max(errors))}
        tensors |= own
    write(folder / "imported.safetensors", tensors, metadata)


def vgg(folder):
    """relu3_3 of VGG16, and the perceptual term of the albedo loss, with weights of the formula (not ImageNet's)."""
    net = torchvision.models.vgg16(weights=None).features[:16]
    with torch.no_grad():
        for name, p in net.named_parameters():
            u = formula(f"vgg.features.{name}", tuple(p.shape))
            fan_in = p.shape[1] * 9 if p.dim() == 4 else 1
            p.copy_((u * math.sqrt(24 / fan_in)).float().double() if p.dim() == 4 else 0.25 * u)
    shape = (2, 3, 20, 24)
    image = formula("image", shape).requires_grad_()
    truth = formula("truth", shape)
    mask = (formula("mask", (2, 1, 20, 24)) > -0.2).double()
    features = net(normalised(image))
    pooled = torch.nn.functional.avg_pool2d(mask, 4).expand_as(features)
    perceptual = ((net(normalised(image * mask)) - net(normalised(truth * mask))) ** 2 * pooled).sum() / pooled.sum()
    perceptual.backward()
    tensors = {"features": some(features, 4096), "perceptual": perceptual.reshape(1), "gradient.image": image.grad}
    write(folder / "vgg16.safetensors", tensors, {"torch": torch.__version__, "size": "2x3x20x24"})


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    densenet(target)
    mgnet(target, "compact")
    mgnet(target, "shared")
    mgnet(target, "lite")
    vgg(target)
    resnet(target)
    imported(target)
