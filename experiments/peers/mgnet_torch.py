"""MGNet (Zhu et al. 2022) in PyTorch, in all presets, with its losses: the peer for speed and for golden values.

    python mgnet_torch.py [--preset compact|paper|shared|lite] [--batch 8] [--size 160x120] [--steps 5] [--layout channels_last|default]

prints the seconds of training steps (forward, losses, backward, Adam) and of inference. Needs torch and torchvision.
Names of parameters are those of the C++ nets, so state dictionaries can be exchanged.
"""
import argparse
import math
import statistics
import time

import torch
import torch.nn.functional as F
import torchvision
from torch import nn

GROUPS = (32, 16, 16, 8, 4)
PRESETS = {
    "paper": {"growth": 32, "first": 64, "decoder": (512, 256, 128, 64, 64)},
    "compact": {"growth": 16, "first": 32, "decoder": (128, 64, 32, 16, 16)},
    "shared": {"growth": 16, "first": 32, "shared": (128, 128, 96, 64, 32, 24)},
    "lite": {"lite": True, "shared": (128, 128, 96, 64, 32, 24)},
}
SHARED_GROUP = 8  # channels of a group of the shared decoder's norms
HEADS = {"albedo": 3, "material": 2, "normal": 3, "depth": 3}


class Encoder(nn.Module):
    def __init__(self, growth, first, inputs=3):
        super().__init__()
        self.features = torchvision.models.DenseNet(growth_rate=growth, block_config=(6, 12, 24, 16), num_init_features=first).features
        del self.features.pool0
        if inputs != 3:
            self.features.conv0 = nn.Conv2d(inputs, first, 7, 2, 3, bias=False)

    def forward(self, image):
        f = self.features
        levels = [f.relu0(f.norm0(f.conv0(image)))]
        for k in (1, 2, 3):
            block = getattr(f, f"denseblock{k}")(levels[-1])
            levels.append(getattr(f, f"transition{k}")(block))
        levels.append(f.norm5(f.denseblock4(levels[-1])))
        return levels


def same_padding(size, kernel, stride):
    """Zeros before and behind, as TensorFlow's SAME has them."""
    total = max((math.ceil(size / stride) - 1) * stride + kernel - size, 0)
    return total // 2, total - total // 2


class SameConv(nn.Conv2d):
    """A convolution with bias over a picture that is padded first."""

    def __init__(self, *sizes, mode="constant", **more):
        super().__init__(*sizes, **more)
        self.mode = mode

    def forward(self, x):
        kernel, stride = self.kernel_size[0], self.stride[0]
        (top, bottom), (left, right) = (same_padding(size, kernel, stride) for size in x.shape[-2:])
        return super().forward(F.pad(x, (left, right, top, bottom), mode=self.mode))


class InvertedResidual(nn.Module):
    def __init__(self, inputs, outputs, kernel, stride, expansion):
        super().__init__()
        inner = inputs * expansion
        if expansion > 1:
            self.expand = nn.Conv2d(inputs, inner, 1)
        self.depthwise = SameConv(inner, inner, kernel, stride, groups=inner)
        self.project = nn.Conv2d(inner, outputs, 1)
        self.identity = stride == 1 and inputs == outputs

    def forward(self, x):
        y = F.relu6(self.expand(x)) if hasattr(self, "expand") else x
        y = self.project(F.relu6(self.depthwise(y)))
        return x + y if self.identity else y


class LiteEncoder(nn.Module):
    """EfficientNet-Lite0 with its batch normalisations folded into the convolutions."""

    STAGES = ((3, 1, 1, 16, 1), (3, 2, 6, 24, 2), (5, 2, 6, 40, 2), (3, 2, 6, 80, 3), (5, 1, 6, 112, 3), (5, 2, 6, 192, 4), (3, 1, 6, 320, 1))
    LEVELS = (0, 1, 2, 4, 6)  # stages whose features are read
    CHANNELS = (16, 24, 40, 112, 320)

    def __init__(self):
        super().__init__()
        self.stem = SameConv(3, 32, 3, 2, mode="replicate")
        inputs = 32
        for s, (kernel, stride, expansion, outputs, layers) in enumerate(self.STAGES):
            blocks = []
            for layer in range(layers):
                blocks.append(InvertedResidual(inputs, outputs, kernel, stride if layer == 0 else 1, expansion))
                inputs = outputs
            setattr(self, f"stage{s}", nn.Sequential(*blocks))

    def forward(self, image):
        """`image`: linear, in [0, 1]."""
        return self.features(2 * torch.exp(torch.log(image + 1e-3) / 2.2) - 1)

    def features(self, coded):
        x, levels = F.relu6(self.stem(coded)), []
        for s in range(len(self.STAGES)):
            x = getattr(self, f"stage{s}")(x)
            if s in self.LEVELS:
                levels.append(x)
        return levels


class Step(nn.Module):
    def __init__(self, inputs, outputs, groups):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, 3, padding=1)
        self.norm = nn.GroupNorm(groups, outputs)

    def forward(self, x):
        return F.relu(self.norm(self.conv(x)))


def fitted(x, height, width):
    if x.shape[-2:] == (height, width):
        return x
    return F.interpolate(x, (height, width), mode="bilinear", align_corners=True)


class Head(nn.Module):
    def __init__(self, inputs, channels):
        super().__init__()
        self.out = nn.Conv2d(inputs, channels, 3)

    def forward(self, x):
        return self.out(F.pad(x, (1, 1, 1, 1), mode="replicate"))


class Decoder(Head):
    def __init__(self, levels, widths, channels):
        super().__init__(widths[4], channels)
        inputs = [levels[4]] + [widths[i] + levels[3 - i] for i in range(4)]
        for i in range(5):
            setattr(self, f"c{i + 1}", Step(inputs[i], widths[i], GROUPS[i]))

    def forward(self, levels, height, width):
        x = self.c1(levels[4])
        for i in range(1, 5):
            skip = levels[4 - i]
            h, w = skip.shape[-2:]
            joined = torch.cat((fitted(x, h, w), skip), 1)
            x = getattr(self, f"c{i + 1}")(fitted(joined, 2 * h, 2 * w))
        return super().forward(fitted(x, height, width))


class SharedDecoder(nn.Module):
    """One decoder for all maps, which is given the picture again at its last step."""

    def __init__(self, levels, widths, picture):
        super().__init__()
        inputs = [levels[4]] + [widths[i] + levels[3 - i] for i in range(4)] + [widths[4] + picture]
        for i, (before, width) in enumerate(zip(inputs, widths)):
            setattr(self, f"c{i + 1}", Step(before, width, width // SHARED_GROUP))

    def forward(self, levels, picture):
        x = self.c1(levels[4])
        for i, larger in enumerate((*levels[3::-1], picture)):
            x = getattr(self, f"c{i + 2}")(torch.cat((fitted(x, *larger.shape[-2:]), larger), 1))
        return x


def with_logarithm(image):
    return torch.cat((image, torch.log(image + 0.01) / -math.log(0.01) + 1), 1)


class Scale(nn.Module):
    """One linear layer: log of the scene's scale from the detached mean of the last features."""

    def __init__(self, channels):
        super().__init__()
        self.weight = nn.Parameter(torch.zeros(1, channels, 1, 1))
        self.bias = nn.Parameter(torch.full((1, 1, 1, 1), 1.5))

    def forward(self, feature):
        pooled = feature.detach().mean((2, 3), keepdim=True)
        return (pooled * self.weight).sum(1, keepdim=True) + self.bias


def densenet_levels(size):
    channels, levels = size["first"], [size["first"]]
    for k, layers in enumerate((6, 12, 24, 16)):
        channels += layers * size["growth"]
        if k < 3:
            channels //= 2
        levels.append(channels)
    return levels


class MGNet(nn.Module):
    def __init__(self, preset):
        super().__init__()
        size = PRESETS[preset]
        self.shared = "shared" in size
        pictures = 6 if self.shared else 3
        self.lite = "lite" in size
        if self.lite:
            self.encoder, levels = LiteEncoder(), LiteEncoder.CHANNELS
        else:
            self.encoder, levels = Encoder(size["growth"], size["first"], pictures), densenet_levels(size)
        if self.shared:
            self.decoder = SharedDecoder(levels, size["shared"], pictures)
        for head, outputs in HEADS.items():
            made = Head(size["shared"][-1], outputs) if self.shared else Decoder(levels, size["decoder"], outputs)
            setattr(self, f"decoder_{head}", made)
        self.scale = Scale(levels[4])

    def forward(self, image):
        height, width = image.shape[-2:]
        picture = with_logarithm(image) if self.shared else image
        levels = self.encoder(image if self.lite else picture)
        reads = (self.decoder(levels, picture),) if self.shared else (levels, height, width)
        raw = {head: getattr(self, f"decoder_{head}")(*reads) for head in HEADS}
        unit = lambda x: torch.clamp(1.01 * torch.sigmoid(x), 0, 1)
        vector = torch.clamp(1.01 * torch.tanh(raw["normal"]), -1, 1)
        return {
            "albedo": unit(raw["albedo"]),
            "material": unit(raw["material"]),
            "normal": vector / vector.norm(dim=1, keepdim=True).clamp(min=1e-6),
            "depth": unit(raw["depth"].mean(1, keepdim=True)),
            "log_scale": self.scale(levels[4]),
        }


def masked(e, mask):
    return (e * mask).sum() / mask.sum()


def losses(maps, truth):
    depth, true_depth, mask = maps["depth"], truth["depth"], truth["geometry_mask"]
    detached = depth.detach()
    sums = lambda x: (x * mask).sum((1, 2, 3), keepdim=True)
    scale = torch.clamp(sums(detached * true_depth) / sums(detached ** 2).clamp(min=1e-5), 0.001, 1000)
    log_error = lambda a, b: ((torch.log1p(a.clamp(min=0)) - torch.log1p(b)) ** 2).sum(1, keepdim=True)
    terms = {
        "albedo": 0.5 / 3 * masked(log_error(maps["albedo"], truth["albedo"]), truth["albedo_mask"]),
        "normal": 0.5 * masked((1 - (maps["normal"] * truth["normal"]).sum(1, keepdim=True)).abs(), mask),
        "material": 0.5 * masked(((maps["material"] - truth["material"]) ** 2).sum(1, keepdim=True), truth["material_mask"]),
        "depth": masked(log_error(scale * depth, true_depth), mask),
        "scale": masked((maps["log_scale"] - truth["log_scale"]) ** 2, truth["scale_mask"]),
    }
    return {"loss": sum(terms.values()), **terms}


def random_batch(n, height, width):
    r = lambda c, *s: torch.rand((n, c) + (s or (height, width)))
    batch = {"image": r(3), "albedo": r(3), "material": r(2), "normal": F.normalize(r(3) - 0.5), "depth": r(1), "log_scale": r(1, 1, 1)}
    for mask in ("albedo_mask", "geometry_mask", "material_mask"):
        batch[mask] = torch.ones(n, 1, height, width)
    batch["scale_mask"] = torch.ones(n, 1, 1, 1)
    return batch


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", choices=PRESETS, default="compact")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--size", default="160x120", help="width x height")
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--layout", choices=("channels_last", "default"), default="channels_last")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    torch.manual_seed(1)
    net = MGNet(arguments.preset)
    batch = random_batch(arguments.batch, height, width)
    if arguments.layout == "channels_last":
        net = net.to(memory_format=torch.channels_last)
        batch = {k: v.to(memory_format=torch.channels_last) for k, v in batch.items()}
    count = sum(p.numel() for name, p in net.named_parameters() if not name.startswith("scale"))
    print(f"{arguments.preset}: {count} parameters without the scale head, torch {torch.__version__}, {torch.get_num_threads()} threads")
    adam = torch.optim.Adam(net.parameters(), lr=5e-4, betas=(0.5, 0.999))

    def step():
        adam.zero_grad()
        losses(net(batch["image"]), batch)["loss"].backward()
        adam.step()

    def timed(work, what):
        work()
        seconds, cpu = [], []
        for _ in range(arguments.steps):
            start, start_cpu = time.perf_counter(), time.process_time()
            work()
            seconds.append(time.perf_counter() - start)
            cpu.append(time.process_time() - start_cpu)
        print(f"{what}: min {min(seconds):.3f} s, median {statistics.median(seconds):.3f} s; CPU seconds min {min(cpu):.3f}")

    timed(step, "training step")
    net.eval()
    with torch.no_grad():
        timed(lambda: net(batch["image"]), "inference")


if __name__ == "__main__":
    main()
