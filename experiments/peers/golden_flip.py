"""Golden values of FLIP by its authors' own evaluator (flip-evaluator of PyPI), for tests/experiments/flip_test.cpp.

    python golden_flip.py ../../tests/data/flip

Writes three pairs of pictures in linear Rec.709, three numbers a pixel, and the map of FLIP of each: a scene and the
same with noise, another with its colours and edges moved, and one that is black beside one that is white.
"""
import pathlib
import sys

import flip_evaluator
import numpy as np
from safetensors.numpy import save_file

WIDTH, HEIGHT = 61, 47


def scene():
    """A sky, a wall with stripes that get finer, a red disc and a lamp that is clipped."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    picture = np.stack([0.1 + 0.5 * y / HEIGHT, 0.2 + 0.3 * x / WIDTH, 0.6 - 0.4 * y / HEIGHT], -1)
    stripes = (np.sin(x * x / 40) > 0) & (y > 30)
    picture[stripes] *= 0.3
    picture[(x - 20) ** 2 + (y - 15) ** 2 < 64] = [0.7, 0.05, 0.02]
    picture[(x - 45) ** 2 + (y - 10) ** 2 < 20] = 1
    return np.clip(picture, 0, 1).astype(np.float32)


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    picture = scene()
    noisy = np.clip(picture * random.gamma(4, 0.25, picture.shape), 0, 1).astype(np.float32)
    moved = np.clip(np.roll(picture, 2, axis=1)[..., [1, 0, 2]], 0, 1).astype(np.float32)
    ends = [np.zeros_like(picture), np.ones_like(picture)]
    tensors = {}
    for name, (reference, test) in {"noisy": (picture, noisy), "moved": (picture, moved), "ends": ends}.items():
        # The evaluator's parameter "ppd" is left at its default, 0.7 m from 3840 pixels on 0.7 m.
        error, mean, parameters = flip_evaluator.evaluate(reference, test, "LDR", inputsRGB=False, applyMagma=False)
        print(name, mean, parameters)
        planar = lambda a: np.ascontiguousarray(np.moveaxis(np.atleast_3d(a), -1, 0)).astype(np.float32)
        tensors |= {f"{name}.reference": planar(reference), f"{name}.test": planar(test), f"{name}.flip": planar(error)}
    save_file(tensors, folder / "flip.safetensors")


main()
