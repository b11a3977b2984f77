"""Nets that `clerestory weights import` made, beside torchvision's own, on random weights and a random picture.

    python imported_nets.py --binary ../../build/clerestory [--gemm clblast] [--device NAME]

Prints of every level of DenseNet121, ResNet34 and VGG16 the largest difference between the two, both in float, as part of
the level's range. Exit 1 where one is above 1e-5. Needs torch and torchvision.
"""
import argparse
import json
import pathlib
import struct
import subprocess
import sys
import tempfile

import torch
import torchvision
from golden_nets import encoder_levels

MOST = 1e-5  # float through 121 normalised layers, each side in its own order
DTYPES = {torch.float32: "F32", torch.int64: "I64"}


def write_safetensors(path, tensors):
    header, at = {}, 0
    for name, t in tensors.items():
        size = t.numel() * t.element_size()
        header[name] = {"dtype": DTYPES[t.dtype], "shape": list(t.shape), "data_offsets": [at, at + size]}
        at += size
    text = json.dumps(header).encode()
    with open(path, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for t in tensors.values():
            file.write(t.contiguous().numpy().tobytes())


def read_safetensors(path):
    data = path.read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    tensors = {}
    for name, entry in json.loads(data[8 : 8 + length]).items():
        if name != "__metadata__":
            begin, end = (8 + length + at for at in entry["data_offsets"])
            tensors[name] = torch.frombuffer(bytearray(data[begin:end]), dtype=torch.float32).reshape(entry["shape"])
    return tensors


def random_net(name):
    """As torchvision begins, with statistics and norms as if it had learned."""
    net = getattr(torchvision.models, name)(weights=None).float().eval()
    for key, t in net.state_dict().items():
        if key.endswith("running_var"):
            t.uniform_(0.5, 1.5)
        elif t.dim() == 1 and not key.startswith("classifier"):
            t.add_(0.1 * torch.randn_like(t))
    return net


def compare(name, arguments, folder):
    net = random_net(name)
    files = {part: folder / f"{name}_{part}.safetensors" for part in ("theirs", "ours", "features")}
    write_safetensors(files["theirs"], net.state_dict())
    subprocess.run([arguments.binary, "weights", "import", files["theirs"], files["ours"], "-q"], check=True, stdout=subprocess.DEVNULL)
    picture = torch.randint(0, 256, (3, arguments.height, arguments.width), dtype=torch.uint8)
    torchvision.io.write_png(picture, str(folder / "picture.png"))
    line = [arguments.binary, "weights", "features", files["ours"], folder / "picture.png", files["features"], "--gemm", arguments.gemm]
    subprocess.run(line + (["--device", arguments.device] if arguments.device else []), check=True, stdout=subprocess.DEVNULL)
    ours = read_safetensors(files["features"])
    with torch.no_grad():
        theirs = encoder_levels(net)(((picture.float() / 255) ** 2.2)[None])
    worst = 0
    for i, level in enumerate(theirs):
        difference = ((ours[f"level{i}"] - level).abs().max() / (level.max() - level.min())).item()
        print(f"{name:<12} level {i} {'x'.join(map(str, level.shape)):>16}   {difference:.2e} of the range")
        worst = max(worst, difference)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default="build/clerestory")
    parser.add_argument("--gemm", default="auto")
    parser.add_argument("--device", default="")
    parser.add_argument("--width", type=int, default=160)
    parser.add_argument("--height", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    torch.set_default_dtype(torch.float32)
    torch.manual_seed(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        worst = max(compare(name, arguments, pathlib.Path(folder)) for name in ("densenet121", "resnet34", "vgg16"))
    print(f"largest: {worst:.2e}, allowed {MOST:.0e}")
    return worst > MOST


if __name__ == "__main__":
    sys.exit(main())
