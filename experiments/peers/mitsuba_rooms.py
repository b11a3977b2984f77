"""Clerestory's path tracer beside Mitsuba 3 on the same rooms: do the pictures agree, and which is sooner done?

    python3 -m venv VENV && VENV/bin/pip install mitsuba==3.9.1 numpy   # LLVM: apt-get install libllvm19
    VENV/bin/python experiments/peers/mitsuba_rooms.py --binary build/clerestory

Each room is traced by `clerestory generate --mitsuba` and by Mitsuba's `path` (clerestory_brdf.py has the surfaces and
panes), one view and its probe. Compared are the mean of the picture, channel by channel, and its pixels by a z-test with
both standard errors, as Mitsuba tests itself: Sidak-corrected at 1 %, and 99.75 % of the values have to pass. What the
first surfaces look like (depth, albedo, roughness, metallic) has to be the same too. The probe's z-test takes the
standard error of blocks of texels from how their differences spread.

Time to a relative mean square error of 0.01, a mean of (x - truth)^2 / (truth^2 + 0.01) at the picture's exposure: the
variance of one sample over 0.01, times the seconds of one. Ours are the difference of two runs, theirs those of the
kernel, both without compiling; --processor-time counts processor seconds of both instead, for a machine that has other
work. RATIO lines say ours over theirs, below 1 where clerestory is sooner done; the last ones
are medians over rooms with one lamp, and with many.

Finished parts stay in --out: the same line goes on after an interruption. Exit 1 when a picture or a probe disagrees.
"""
import argparse
import json
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARIES = ["/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", "/usr/lib/x86_64-linux-gnu/libLLVM-16.so.1",
             "/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1", "/usr/lib/x86_64-linux-gnu/libLLVM-14.so.1"]
MEAN_BAR, PASS_BAR, SIGNIFICANCE = 0.01, 0.9975, 0.01
LANES = 1 << 23  # paths of one launch
BLOCK = 4        # texels of a probe that are judged as one, along each side
TIMED = (16, 80), 64, 3  # samples of the two runs that time ours, of Mitsuba's, and how often
MANY = 20        # lamps
HALF = 2.0**-11 / math.sqrt(3)  # what storing a picture in half adds to its standard error, as a share
PROBE_WIDTH, PROBE_HEIGHT = 128, 64


def usage(message):
    print(message, file=sys.stderr)
    sys.exit(2)


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", required=True, help="the clerestory program")
    parser.add_argument("--rooms", default=ROOT / "experiments/rooms/judge_training.rooms", type=pathlib.Path,
                        help="file of rooms")
    parser.add_argument("--of", type=int, default=200, help="rooms of that file")
    parser.add_argument("--which", default="54,86,151,20,33,60,127,197,74,21", help="numbers of the rooms to take")
    parser.add_argument("--samples", type=int, default=4096, help="of a pixel")
    parser.add_argument("--probe-samples", type=int, default=128, help="of a texel of a probe; 0: no probes")
    parser.add_argument("--size", default="128x96")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba; a JIT variant")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/mitsuba_rooms", help="what is finished")
    parser.add_argument("--processor-time", action="store_true", help="of all cores together, in place of the clock's")
    parser.add_argument("--no-time", action="store_true", help="compare pictures only")
    parser.add_argument("--no-pictures", action="store_true", help="of rooms whose pictures are finished: time only")
    return parser.parse_args()


# ---- Ours -----------------------------------------------------------------------------------------------------------


def processor_seconds(whose):
    return resource.getrusage(whose).ru_utime


def generate(options, number, folder, samples, *more):
    """The folder of the room, and what the program says of it."""
    with tempfile.NamedTemporaryFile(suffix=".json") as said:
        command = [options.binary, "generate", "--from-rooms", options.rooms, "--shard", f"{number}/{options.of}",
                   "--views", 1, "--size", options.size, "--spp", samples, "--out", folder, f"--json={said.name}",
                   "--quiet", *more]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode != 0:
            usage(f"{' '.join(map(str, command))} failed:\n{done.stderr}")
        summary = json.loads(pathlib.Path(said.name).read_text())
    return next(p for p in sorted(folder.iterdir()) if p.is_dir()), summary


def read_exr(path):
    bitmap = mi.Bitmap(str(path))
    return np.array(bitmap, dtype=np.float64).reshape(bitmap.height(), bitmap.width(), -1)


def picture_of(room, camera):
    exposure = camera["exposure"]
    return read_exr(room / "000_im.exr") / exposure, read_exr(room / "000_variance.exr") / exposure**2


# ---- Mitsuba --------------------------------------------------------------------------------------------------------


class Peer:
    """A room in Mitsuba."""

    def __init__(self, room):
        self.scene = mi.load_file(str(room / "mitsuba/scene.xml"))
        plugins.prepare(self.scene)
        self.camera = json.loads((room / "000_camera.json").read_text())
        self.pose = np.array(self.camera["camera_to_world"]).reshape(4, 4)

    def pixel_rays(self, pixel):
        """Through the centre of each: the tracer's samples of a pixel all go there."""
        c = self.camera
        plugins.look_from(self.pose[:3, 3], 1 / math.sqrt(c["fx"] * c["fy"]), -self.pose[:3, 2])
        x, y = mi.Float(pixel % c["width"]), mi.Float(pixel // c["width"])
        at = mi.Point2f((x + 0.5) / c["width"], (y + 0.5) / c["height"])
        return self.scene.sensors()[0].sample_ray(0, 0.5, at, mi.Point2f(0.5))[0]

    def probe_rays(self, texel, center):
        """From a point in camera axes through the centres of a panorama's texels."""
        origin = self.pose[:3, :3] @ center + self.pose[:3, 3]
        plugins.look_from(origin, 2 * math.pi / PROBE_WIDTH)
        x, y = mi.Float(texel % PROBE_WIDTH), mi.Float(texel // PROBE_WIDTH)
        sine, cosine = dr.sincos(dr.pi * (y + 0.5) / PROBE_HEIGHT)
        phi = 2 * dr.pi * ((x + 0.5) / PROBE_WIDTH - 0.5)
        d = mi.Vector3f(dr.sin(phi) * sine, cosine, -dr.cos(phi) * sine)
        turned = [dr.dot(mi.Vector3f(*map(float, self.pose[i, :3])), d) for i in range(3)]
        return mi.RayDifferential3f(mi.Point3f(*map(float, origin)), mi.Vector3f(*turned))

    def trace(self, rays, count, samples, seed=1, times=None):
        """Sums of radiance and of its squares, {count, 3} each."""
        at_once = min(samples, max(1, LANES // count))
        sums, squares, done = np.zeros((count, 3)), np.zeros((count, 3)), 0
        sampler = mi.load_dict({"type": "independent"})
        while done < samples:
            part = min(at_once, samples - done)
            ray = rays(dr.arange(mi.UInt32, count * part) // part)
            dr.eval(ray)
            sampler.seed(dr.opaque(mi.UInt32, seed), count * part)
            radiance = self.scene.integrator().sample(self.scene, sampler, mi.RayDifferential3f(ray))[0]
            dr.kernel_history_clear()
            before = processor_seconds(resource.RUSAGE_SELF)
            dr.eval(radiance)
            dr.sync_thread()
            if times is not None:
                longest = max(kernel.get("execution_time", 0) for kernel in dr.kernel_history()) / 1e3
                times.append((longest, processor_seconds(resource.RUSAGE_SELF) - before))
            sums += np.stack([np.array(dr.block_sum(c, part)) for c in radiance], -1)
            squares += np.stack([np.array(dr.block_sum(c * c, part)) for c in radiance], -1)
            done, seed = done + part, seed + 1
        return sums, squares

    def picture(self, samples, **more):
        shape = self.camera["height"], self.camera["width"], 3
        sums, squares = self.trace(self.pixel_rays, shape[0] * shape[1], samples, **more)
        mean = sums / samples
        return mean.reshape(shape), (np.maximum(squares / samples - mean**2, 0) / (samples - 1)).reshape(shape)

    def probe(self, samples, center):
        rays = lambda texel: self.probe_rays(texel, np.array(center))
        mean = self.trace(rays, PROBE_WIDTH * PROBE_HEIGHT, samples, seed=1 << 20)[0] / samples
        return mean.reshape(PROBE_HEIGHT, PROBE_WIDTH, 3)

    def maps(self):
        """Depth, albedo, roughness and metallic of what each pixel shows, {h, w, 6}."""
        height, width = self.camera["height"], self.camera["width"]
        ray = self.pixel_rays(dr.arange(mi.UInt32, height * width))
        si = self.scene.ray_intersect(ray)
        towards = -ray.d
        surface = np.array(dr.reinterpret_array(mi.UInt32, si.bsdf()))
        values = np.zeros((height * width, 6))
        values[:, 0] = np.array(dr.dot(si.p - mi.Point3f(*map(float, self.pose[:3, 3])),
                                       mi.Vector3f(*map(float, -self.pose[:3, 2]))))
        for bsdf in {id(s.bsdf()): s.bsdf() for s in self.scene.shapes()}.values():
            mine = surface == int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0])
            if mine.any():
                albedo, roughness, metallic = bsdf.material(si, towards, True)
                columns = np.stack([np.array(c) for c in (*albedo, roughness, metallic)], -1)
                values[mine, 1:] = columns[mine]
        return values.reshape(height, width, 6)

    def lamps(self):
        """Parts that shine, panes aside: pieces of meshes that hang together."""
        return sum(pieces(shape) for shape in self.scene.shapes()
                   if shape.is_emitter() and not isinstance(shape.emitter(), plugins.ClerestoryPane))


def pieces(mesh):
    values = mi.traverse(mesh)
    corners = np.array(values["vertex_positions"]).reshape(-1, 3)
    place = np.unique(corners, axis=0, return_inverse=True)[1].ravel()
    label = np.arange(place.max() + 1)
    faces = place[np.array(values["faces"]).reshape(-1, 3)]
    while True:
        least = label[faces].min(1)
        after = label.copy()
        for k in range(3):
            np.minimum.at(after, faces[:, k], least)
        if (after == label).all():
            return len(np.unique(label[faces]))
        label = after


# ---- Comparing ------------------------------------------------------------------------------------------------------


def two_sided(z, freedom=None):
    """Probability that noise alone gives a |z| as large; with degrees of freedom, that of Student's t, by Hill's
    approximation of its normal equivalent (Communications of the ACM, 1970)."""
    z = np.abs(z)
    if freedom:
        n = freedom
        a, b = n - 0.5, 48 * (n - 0.5)**2
        y = a * np.log1p(z * z / n)
        z = (1 + (y + 3 - (0.4 * y**3 + 3.3 * y * y + 24 * y + 85.5) / (0.8 * y * y + 100 + b)) / b) * np.sqrt(y)
    return np.vectorize(lambda v: math.erfc(v / math.sqrt(2)))(z)


def passing(p):
    """Share of values that pass, Sidak-corrected for their number; channels count as one place."""
    places = p.size // 3
    return float((p > 1 - (1 - SIGNIFICANCE)**(1 / places)).mean())


def worst_mean(ours, theirs):
    a, b = (x.reshape(-1, 3).mean(0) for x in (ours, theirs))
    return float(np.max(np.abs(a / b - 1)))


def worst_error(error, theirs):
    """Standard error of a mean of values with such errors, over the mean."""
    channels = error.reshape(-1, 3)
    return float(np.max(np.sqrt((channels**2).sum(0)) / len(channels) / theirs.reshape(-1, 3).mean(0)))


def in_blocks(difference):
    h, w, _ = difference.shape
    cut = difference[: h // BLOCK * BLOCK, : w // BLOCK * BLOCK]
    return cut.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).transpose(0, 2, 1, 3, 4).reshape(-1, BLOCK**2, 3)


def block_means(ours, theirs):
    """Means of differences over blocks, and the means' standard errors."""
    blocks = in_blocks(ours - theirs)
    return blocks.mean(1), np.maximum(blocks.std(1, ddof=1) / BLOCK, 1e-12)


def relative_variance(variance, samples, truth, exposure):
    """relMSE of a picture of one sample."""
    return float((samples * variance / (truth**2 + 0.01 / exposure**2)).mean())


def compare_pictures(options, number):
    probes = ["--probes", 1, "--light-spp", max(1, options.probe_samples // 4)] if options.probe_samples else ["--no-light"]
    room, summary = generate(options, number, options.out / f"{number:05}", options.samples, "--mitsuba", *probes)
    peer = Peer(room)
    exposure = peer.camera["exposure"]
    ours, our_variance = picture_of(room, peer.camera)
    theirs, their_variance = peer.picture(options.samples)
    error = np.sqrt(our_variance + their_variance + (HALF * ours)**2 + (1e-6 / exposure)**2)
    z = (ours - theirs) / error
    maps = [read_exr(room / "000_depth.exr")[..., :1] / 1000, read_exr(room / "000_albedo.exr"),
            read_exr(room / "000_material.exr")[..., :2]]
    off = np.abs(np.concatenate(maps, -1) - peer.maps())
    truth = (ours + theirs) / 2
    result = {
        "lamps": peer.lamps(),
        "mean": worst_mean(ours, theirs),
        "mean_error": worst_error(error, theirs),
        "pass": passing(two_sided(z)),
        "z": [float(z.mean()), float(z.std())],
        "maps": float((off.max(-1) < 2e-3).mean()),
        "ours": relative_variance(our_variance, options.samples, truth, exposure),
        "theirs": relative_variance(their_variance, options.samples, truth, exposure),
        "dropped": summary["dropped_samples"],
    }
    if options.probe_samples and (room / "000_probe_00.exr").exists():
        center = json.loads((room / "000_probes.json").read_text())[0]["center"]
        probe, other = read_exr(room / "000_probe_00.exr") / exposure, peer.probe(options.probe_samples, center)
        difference, deviation = block_means(probe, other)
        result["probe_mean"] = worst_mean(probe, other)
        result["probe_error"] = worst_error(deviation, other)
        result["probe_pass"] = passing(two_sided(difference / deviation, BLOCK**2 - 1))
        np.savez_compressed(options.out / f"{number:05}/probe.npz", ours=probe, theirs=other)
    np.savez_compressed(options.out / f"{number:05}/picture.npz", ours=ours, theirs=theirs, error=error, exposure=exposure)
    return result


def seconds_of_ours(options, number):
    """Seconds of one sample of every pixel: two runs that differ in nothing else."""
    seconds = []
    for samples in TIMED[0]:
        with tempfile.TemporaryDirectory() as folder:
            before = processor_seconds(resource.RUSAGE_CHILDREN)
            clock = generate(options, number, pathlib.Path(folder) / "set", samples, "--no-light")[1]["seconds"]
            seconds.append(processor_seconds(resource.RUSAGE_CHILDREN) - before if options.processor_time else clock)
    return (seconds[1] - seconds[0]) / (TIMED[0][1] - TIMED[0][0])


def compare_times(options, number):
    room = next(p for p in sorted((options.out / f"{number:05}").iterdir()) if p.is_dir())
    peer = Peer(room)
    peer.picture(2)  # compiles
    ours, theirs = [], []
    for turn in range(TIMED[2]):  # in turns: both meet the machine's other work alike
        ours.append(seconds_of_ours(options, number))
        times = []
        peer.picture(TIMED[1], seed=100 * (turn + 1), times=times)
        theirs.append(sum(t[options.processor_time] for t in times) / TIMED[1])
    return {"our_seconds": float(np.median(ours)), "their_seconds": float(np.median(theirs))}


# ---- The whole ------------------------------------------------------------------------------------------------------


def once(path, make):
    """What stands in a file of JSON, made if there is none."""
    if not path.exists():
        value = make()
        path.write_text(json.dumps(value, indent=1) + "\n")
    return json.loads(path.read_text())


def ratio_of(result):
    return result["ours"] * result["our_seconds"] / (result["theirs"] * result["their_seconds"])


def row(number, r):
    probe = f"{'-':>9}{'-':>7}{'-':>9}"
    if "probe_mean" in r:
        probe = f"{100 * r['probe_mean']:9.2f}{100 * r['probe_error']:7.2f}{100 * r['probe_pass']:9.2f}"
    time = ""
    if "our_seconds" in r:
        ours, theirs = (r[k] * r[s] / 0.01 for k, s in (("ours", "our_seconds"), ("theirs", "their_seconds")))
        time = f"{ours:9.1f}{theirs:9.1f}{ratio_of(r):7.2f}"
    return (f"{number:5}{r['lamps']:6}{100 * r['mean']:9.2f}{100 * r['mean_error']:7.2f}{100 * r['pass']:9.2f}"
            f"{r['z'][0]:8.2f}{r['z'][1]:7.2f}{100 * r['maps']:9.2f}{probe}{time}")


def agrees(r):
    picture = r["mean"] < MEAN_BAR and r["pass"] >= PASS_BAR and r["dropped"] == 0
    return picture and r.get("probe_mean", 0) < MEAN_BAR and r.get("probe_pass", 1) >= PASS_BAR


def report(options, results):
    timed = [r for r in results if "our_seconds" in r]
    for name, group in (("one lamp", [r for r in timed if r["lamps"] == 1]),
                        (f"{MANY} lamps and more", [r for r in timed if r["lamps"] >= MANY]),
                        ("10 lamps and more", [r for r in timed if r["lamps"] >= 10])):
        if group:
            print(f"RATIO time to relMSE 0.01, {name}, {len(group)} rooms: {np.median([ratio_of(r) for r in group]):.2f}")
    wrong = sum(not agrees(r) for r in results)
    print(f"{len(results) - wrong} of {len(results)} rooms agree at {options.samples} samples: mean below "
          f"{100 * MEAN_BAR:.0f} %, {100 * PASS_BAR} % of pixels and of the probe's blocks pass")
    return 1 if wrong else 0


def start_mitsuba(options):
    global mi, dr, plugins
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = [path for path in LIBRARIES if os.path.exists(path)]
        if found:
            os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError as error:
        usage(f"{error}: this comparison needs Mitsuba 3, `pip install mitsuba numpy`")
    mi.set_variant(options.variant)
    dr.set_flag(dr.JitFlag.KernelHistory, True)
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import clerestory_brdf as plugins
    print(f"Mitsuba {mi.__version__}, {options.variant}, {dr.thread_count()} threads")


def main():
    options = read_arguments()
    if not os.access(options.binary, os.X_OK):
        usage(f"--binary {options.binary}: no program; `ninja -C build clerestory` makes one")
    options.binary = pathlib.Path(options.binary).resolve()
    start_mitsuba(options)
    options.out = options.out / f"{options.size}-{options.samples}"
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"{'room':>5}{'lamps':>6}{'mean %':>9}{'error':>7}{'pass %':>9}{'z mean':>8}{'std':>7}{'maps %':>9}"
          f"{'probe %':>9}{'error':>7}{'pass %':>9}{'ours s':>9}{'theirs s':>9}{'ratio':>7}")
    results = []
    for number in map(int, options.which.split(",")):
        folder = options.out / f"{number:05}"
        if options.no_pictures and not (folder / "picture.json").exists():
            continue
        folder.mkdir(exist_ok=True)
        result = once(folder / "picture.json", lambda: compare_pictures(options, number))
        if not options.no_time:
            result |= once(folder / "time.json", lambda: compare_times(options, number))
        print(row(number, result), flush=True)
        results.append(result)
    return report(options, results)


if __name__ == "__main__":
    sys.exit(main())
