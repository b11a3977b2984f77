"""Mitsuba's rough conductor, sampled and evaluated with its gradients, beside our whole layer, in turns.

    python3 experiments/peers/mitsuba_layer.py --binary build/clerestory

Needs mitsuba, numpy, safetensors and LLVM's library (apt-get install libllvm19, or DRJIT_LIBLLVM_PATH). As many samples as ours has, each from
its pixel's roughness and reflectance: `sample`, `eval` of what it gave, their ratio times a radiance that is there
already, and back to the two maps and to that radiance. Mitsuba traces no ray, has no diffuse lobe and no normals here;
ours does all that the layer is (`clerestory bench layer`: "given, gradients"). Compile time is in neither.

Prints `RATIO <name> <our time / peer's time> bar <most>`, marked `busy` where another process took over 5 % of the cores
meanwhile. Exit 1 when the bar is missed.
"""
import argparse
import os
import pathlib
import statistics
import sys
import tempfile
import time

BAR = 1 / 2
LIBRARY = "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1"  # LLVM 15 cannot compile what Dr.Jit 1.5 writes


def prepare_llvm():
    if pathlib.Path(LIBRARY).exists():
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", LIBRARY)


class Peer:
    def __init__(self, dr, mi, scene):
        self.dr, self.mi = dr, mi
        height, width = scene["depth"].shape[1:]
        samples = scene["samples"]
        count = height * width * samples
        bitmap = lambda data: mi.TensorXf(data.transpose(1, 2, 0).copy())
        texture = lambda tensor: {"type": "bitmap", "data": tensor, "raw": True, "filter_type": "nearest"}
        alpha = (scene["material"][:1] ** 2).clip(1e-4)
        self.bsdf = mi.load_dict(
            {
                "type": "roughconductor",
                "distribution": "ggx",
                "alpha": texture(bitmap(alpha)),
                "specular_reflectance": texture(bitmap(scene["albedo"])),
            }
        )
        self.params = mi.traverse(self.bsdf)
        self.keys = [key for key in self.params.keys() if key.endswith("data")]
        index = dr.arange(mi.UInt32, count) // samples
        x, y = mi.Float(index % width) + 0.5, mi.Float(index // width) + 0.5
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.uv = mi.Point2f(x / width, y / height)
        fx, fy, cx, cy = map(float, scene["camera"])
        view = -dr.normalize(mi.Vector3f((x - cx) / fx, (cy - y) / fy, -1))
        normal = [dr.gather(mi.Float, mi.Float(scene["normal"][c].ravel()), index) for c in range(3)]
        si.n = mi.Normal3f(*normal)
        si.sh_frame = mi.Frame3f(si.n)
        si.wi = si.to_local(view)
        self.si = si
        rng = mi.PCG32(count)
        self.numbers = [rng.next_float32() for _ in range(3)]
        self.radiance = mi.Color3f(*(rng.next_float32() for _ in range(3)))
        dr.eval(self.si, self.numbers, self.radiance)
        dr.sync_thread()

    def run(self):
        dr, mi = self.dr, self.mi
        wrt = [self.params[key] for key in self.keys] + [self.radiance]
        for value in wrt:
            dr.enable_grad(value)
        self.params.update()
        drawn, _ = self.bsdf.sample(mi.BSDFContext(), self.si, self.numbers[0], mi.Point2f(*self.numbers[1:]))
        wo, pdf = dr.detach(drawn.wo), dr.detach(drawn.pdf)
        value = self.bsdf.eval(mi.BSDFContext(), self.si, wo)
        dr.backward(dr.sum(dr.select(pdf > 0, value / pdf, 0) * self.radiance))
        grads = [dr.grad(value) for value in wrt]
        dr.eval(grads)
        dr.sync_thread()
        return grads


def seconds_of(peer):
    start = time.perf_counter()
    peer.run()
    return time.perf_counter() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="build/clerestory")
    parser.add_argument("--rounds", type=int, default=3, help="of each program: three runs each")
    options = parser.parse_args()
    prepare_llvm()
    import drjit as dr
    import mitsuba as mi
    from layer_runs import layer_runs
    from load import Load
    from safetensors import safe_open
    from safetensors.numpy import load_file

    mi.set_variant("llvm_ad_rgb")
    name = "given, gradients, 160x120, 64 samples"
    with tempfile.TemporaryDirectory() as folder:
        layer_runs(options.binary, name, 1, f"--write={folder}")
        path = os.path.join(folder, "layer.safetensors")
        scene = load_file(path)
        with safe_open(path, "np") as file:
            scene["samples"] = int(file.metadata()["samples"])
    peer = Peer(dr, mi, scene)
    seconds_of(peer)
    own, theirs = [], []
    with Load() as load:
        for _ in range(options.rounds):
            own += layer_runs(options.binary, name, 3)
            theirs += [seconds_of(peer) for _ in range(3)]
    ours, other = statistics.median(own), statistics.median(theirs)
    busy = f"  busy: others took {100 * load.others:.0f} %" if load.others > 0.05 else ""
    met = ours / other <= BAR
    print(
        f"RATIO {name}, beside Mitsuba {mi.__version__} {ours / other:.3f}  bar {BAR}  "
        f"({1e3 * ours:.0f} ms, {1e3 * other:.0f} ms){busy}{'' if met else '  missed'}"
    )
    sys.exit(0 if met else 1)


if __name__ == "__main__":
    main()
