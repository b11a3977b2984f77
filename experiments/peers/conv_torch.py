"""PyTorch's convolutions (oneDNN on CPUs) at the shapes that `clerestory bench conv --json=FILE` measured.

    clerestory bench conv --json=conv.json && python3 experiments/peers/conv_torch.py conv.json [--threads N]

Channels-last and default layout, forward, backward data and backward weights, best of ten runs or of a third of a second.
Machines are noisy: measure both programs in the same minutes.
"""
import argparse
import json
import time

import torch


def best_seconds(run):
    run()
    best, start = float("inf"), time.perf_counter()
    for i in range(10):
        before = time.perf_counter()
        run()
        after = time.perf_counter()
        best = min(best, after - before)
        if after - start > 0.33:
            break
    return best


def passes(shape, layout):
    x, w = (torch.randn(shape[k]).contiguous(memory_format=layout) for k in ("x", "w"))
    stride, pad = [shape["stride"]] * 2, [shape["pad"]] * 2
    y = torch.nn.functional.conv2d(x, w, None, stride, pad)
    dy = torch.randn_like(y)

    def backward(mask):
        return torch.ops.aten.convolution_backward(dy, x, w, [0], stride, pad, [1, 1], False, [0, 0], 1, mask)

    return {
        "forward": best_seconds(lambda: torch.nn.functional.conv2d(x, w, None, stride, pad)),
        "data": best_seconds(lambda: backward([True, False, False])),
        "weights": best_seconds(lambda: backward([False, True, False])),
    }


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("file", help="written by clerestory bench conv --json=FILE")
    arguments.add_argument("--threads", type=int, default=0, help="0: PyTorch's own choice")
    options = arguments.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
    with open(options.file, encoding="utf-8") as file:
        groups = json.load(file)["conv"]["groups"]
    print(f"PyTorch {torch.__version__}, {torch.get_num_threads()} threads; GFLOP/s forward, backward data, backward weights")
    for group in groups:
        print(group["name"])
        print(f"{'layer':14}{'clerestory':>21}{'channels-last':>21}{'default layout':>21}")
        totals = [0.0, 0.0, 0.0]
        with torch.no_grad():
            for shape in group["shapes"]:
                ours = shape["seconds"][shape["tile"]]
                last = passes(shape, torch.channels_last)
                plain = passes(shape, torch.contiguous_format)
                columns = ""
                for i, seconds in enumerate((ours, last, plain)):
                    columns += "".join(f"{shape['flops'] / seconds[p] / 1e9:7.0f}" for p in ("forward", "data", "weights"))
                    totals[i] += sum(seconds.values())
                print(f"{shape['name']:14}{columns}", flush=True)
        print(f"{'all, ms':14}" + "".join(f"{1e3 * t:21.1f}" for t in totals))


if __name__ == "__main__":
    main()
