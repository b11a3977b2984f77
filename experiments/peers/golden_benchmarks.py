"""Golden values of benchmark metrics by torchmetrics, scikit-image, NumPy and PyTorch, for
tests/experiments/benchmark_errors_test.cpp.

    python golden_benchmarks.py ../../tests/data/benchmarks     # writes predictions, truths and their figures
    python golden_benchmarks.py --compare FOLDER                # whether the figures in FOLDER are still these

Predictions and truths are made by a formula and noise. Each figure is a peer's own where it has one: PSNR by both
torchmetrics and scikit-image, which have to agree; SSIM by each of them, which treat borders differently (torchmetrics
since some version after 1.3); mean squares by torchmetrics. The others follow the conventions that the header of
experiments/evaluation/benchmark_errors.hpp states, in double precision. Needs torch, torchmetrics, scikit-image, scipy,
safetensors.
"""
import json
import pathlib
import sys

import numpy as np
import torch
from safetensors.numpy import load_file, save_file
from skimage.metrics import peak_signal_noise_ratio, structural_similarity
from torchmetrics.image import PeakSignalNoiseRatio, StructuralSimilarityIndexMeasure
from torchmetrics.regression import MeanSquaredError

HEIGHT, WIDTH = 37, 52


def maps():
    """Planar float maps: albedo in [0, 1], normals, depths in metres on both sides of the limits, a mask."""
    random = np.random.default_rng(5)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    albedo = np.stack([0.2 + 0.6 * x / WIDTH, 0.5 + 0.4 * np.sin(x * y / 60), 0.9 - 0.8 * y / HEIGHT])
    albedo[:, 10:20, 15:30] = 0.05
    guess = np.clip(0.8 * albedo + 0.1 + random.normal(0, 0.08, albedo.shape), 0, 1)
    normal = np.stack([np.sin(x / 9), np.cos(y / 7), 0.3 + np.ones_like(x)])
    normal /= np.linalg.norm(normal, axis=0)
    tilted = 0.7 * normal + random.normal(0, 0.2, normal.shape)  # of any length, as resized maps are
    depth = 0.6 + 11 * (x / WIDTH) ** 2 + 0.2 * np.sin(y)
    relative = np.clip(0.09 * depth + random.normal(0, 0.03, depth.shape), 0.01, None)
    mask = (random.random(depth.shape) > 0.3).astype(np.float64)
    tensors = {"albedo": albedo, "albedo.predicted": guess, "normal": normal, "normal.predicted": tilted,
               "depth": depth[None], "depth.predicted": relative[None], "mask": mask[None]}
    resized = torch.nn.functional.interpolate(torch.tensor(albedo.astype(np.float32)).double()[None], (20, 90),
                                              mode="bilinear", align_corners=False)
    tensors["albedo.resized"] = resized[0].numpy()
    return {name: np.ascontiguousarray(t).astype(np.float32) for name, t in tensors.items()}


def agreed(name, *values):
    assert max(values) - min(values) < 1e-4, (name, values)
    return values[0]


def psnr(a, b):
    return agreed("psnr", PeakSignalNoiseRatio(data_range=1.0)(torch.tensor(b)[None], torch.tensor(a)[None]).item(),
                  peak_signal_noise_ratio(a.astype(np.float64), b.astype(np.float64), data_range=1))


def ssim(a, b):
    """By torchmetrics, which mirrors the border, and by scikit-image, which leaves it out."""
    mirrored = StructuralSimilarityIndexMeasure(data_range=1.0)(torch.tensor(b).double()[None],
                                                                torch.tensor(a).double()[None]).item()
    left_out = structural_similarity(a.astype(np.float64), b.astype(np.float64), data_range=1, channel_axis=0,
                                     gaussian_weights=True, sigma=1.5, use_sample_covariance=False)
    return mirrored, left_out


def mse(a, b, mask):
    """Over masked pixels and all channels."""
    kept = np.broadcast_to(mask > 0.5, a.shape)
    return MeanSquaredError()(torch.tensor(b[kept].astype(np.float64)), torch.tensor(a[kept].astype(np.float64))).item()


def angles(predicted, truth, mask, unit):
    predicted = predicted.astype(np.float64)
    truth = truth / np.linalg.norm(truth.astype(np.float64), axis=0)
    if unit:
        predicted = predicted / np.linalg.norm(predicted, axis=0)
    kept = np.degrees(np.arccos(np.clip((predicted * truth).sum(0), -1, 1)))[mask[0] > 0.5]
    return kept.mean(), np.median(kept)


def centred_log(predicted, truth):
    p, t = np.log(predicted.astype(np.float64) + 1e-20), np.log(truth.astype(np.float64))
    kept = (truth > 1) & (truth < 10)
    return np.mean((p - p.mean() - t + t.mean())[kept] ** 2)


def scaled(predicted, truth, mask):
    kept = np.broadcast_to(mask > 0.5, truth.shape)
    p, t = predicted.astype(np.float64), truth.astype(np.float64)
    return p * np.clip((p * t)[kept].sum() / max((p * p)[kept].sum(), 1e-5), 0.001, 1000)


def figures(m):
    mask = m["mask"]
    unit = angles(m["normal.predicted"], m["normal"], mask, True)
    raw = angles(m["normal.predicted"], m["normal"], mask, False)
    similar = ssim(m["albedo"], m["albedo.predicted"])
    log_error = centred_log(m["depth.predicted"], m["depth"])
    fitted = np.maximum(0, scaled(m["depth.predicted"], m["depth"], mask))
    return {
        "psnr": psnr(m["albedo"], m["albedo.predicted"]),
        "ssim_mirrored": similar[0], "ssim_left_out": similar[1],
        "albedo_mse": mse(m["albedo"], m["albedo.predicted"], mask),
        "albedo_scaled_mse": mse(m["albedo"], np.clip(scaled(m["albedo.predicted"], m["albedo"], mask), 0, 1), mask),
        "normal_mean": unit[0], "normal_median": unit[1], "normal_mean_raw": raw[0], "normal_median_raw": raw[1],
        "depth_log": log_error, "depth_log_rooted": np.sqrt(log_error),
        "depth_scaled_log": mse(np.log1p(m["depth"].astype(np.float64)), np.log1p(fitted), mask)}


def main():
    compare = sys.argv[1] == "--compare"
    folder = pathlib.Path(sys.argv[-1])
    stored = load_file(folder / "maps.safetensors") if compare else maps()
    found = {name: float(value) for name, value in figures(stored).items()}
    if compare:
        kept = json.loads((folder / "figures.json").read_text())
        worst = max(abs(found[name] - kept[name]) for name in found)
        print(f"figures {len(found)} worst difference {worst:.2e}")
        sys.exit(worst > 1e-6)
    folder.mkdir(parents=True, exist_ok=True)
    save_file(stored, folder / "maps.safetensors")
    (folder / "figures.json").write_text(json.dumps(found, indent=1) + "\n")


main()
