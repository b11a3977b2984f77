"""What the kernels take of a GPU, as clang compiles them for AMD's: registers, scratch, local memory, waves; of each the
variant that leaves fewest waves.

Nothing is run: this says where a body spills or keeps too few waves at work, not how fast it is. Bodies are those that a
GPU gets: work-groups of 128, trees of four, convolution by conv_gpu. Debian 12: apt-get install clang-15 libclc-15
    python3 experiments/peers/gpu_registers.py [--gpu gfx906] [--into docs/speed.md] [FILE.cl ...]
Ends with exit code 1 when a kernel does not compile, or keeps numbers in scratch and is not in SPILLS.
"""

import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Bodies that CPUs alone get, and programs that measure or that tests look through.
NOT_GPU = {"nn/conv_cpu.cl", "nn/conv_winograd.cl", "tensor/tile.cl", "tensor/probe.cl", "tensor/ceilings.cl",
           "lib/surface_probe.cl", "trace/scene_probe.cl"}
OF_GPU = {"GROUP": "128"}
OF_TREE = {"BVH_WIDTH": "4", "BVH_STACK": "8"}  # BvhForm::short_stack
# Kernels that are known to keep numbers in scratch, and why.
SPILLS = {
    "trace_view": "frame of `textured`, a function that is called",
    "trace_rays": "frame of `textured`, a function that is called",
    "trace_maps": "frame of `textured`, a function that is called",
    "sample_brdf": "frame of `samples_of`, a function that is called",
    "sample_brdf_adjoint": "frame of `samples_of`, a function that is called",
    "im2col": "written, never read",
}
FIGURES = {"VGPR": "NumVgprs", "SGPR": "NumSgprs", "scratch": "ScratchSize", "local": "LDSByteSize", "waves": "Occupancy"}
MARK, END = "<!-- gpu registers -->", "<!-- end of gpu registers -->"


def variants():
    """(file, defines) of every program a GPU builds: features from checks/variants.txt, forms by the device."""
    found = {(str(f.relative_to(ROOT / "kernels")), ()) for f in (ROOT / "kernels").glob("*/*.cl")}
    for line in (ROOT / "checks/variants.txt").read_text().splitlines():
        if line.startswith("#"):
            continue
        name, *defines = line.split()
        kept = tuple(d for d in defines if not re.match(r"(GROUP|GROUP_RAYS|TILE_ROWS|TILE_WIDTH|PACKET|BVH_\w+|"
                                                        r"WEIGHTS_AS_STORED)=", d))
        found.add((name.split(":")[0], kept))
    return sorted(v for v in found if v[0] not in NOT_GPU and (ROOT / "kernels" / v[0]).exists())


def compiled(gpu, file, defines):
    """{kernel: {figure: number}} of one program; a string when it does not compile."""
    forced = dict(OF_GPU)
    if file.startswith("trace/"):
        forced = OF_TREE
    if file == "light/ssrt.cl":
        forced = {"PACKET": "1"}
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.s"
        command = ["clang-15", "-target", "amdgcn-mesa-mesa3d", f"-mcpu={gpu}", "-x", "cl", "-cl-std=CL1.2", "-O3", "-w",
                   "-nogpulib", "-Xclang", "-finclude-default-header", "-Xclang", "-mlink-builtin-bitcode",
                   "-Xclang", f"/usr/lib/clc/{gpu}-amdgcn-mesa-mesa3d.bc", f"-I{ROOT / 'kernels'}",
                   *[f"-D{k}={v}" for k, v in forced.items()], *[f"-D{d}" for d in defines],
                   "-S", "-o", str(out), str(ROOT / "kernels" / file)]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode != 0:
            return run.stderr
        kernels = {}
        for part in re.split(r"\n\s*\.globl\s+", out.read_text())[1:]:
            if ".amdgpu_hsa_kernel" not in part and "Kernel info" not in part:
                continue  # a function that kernels call
            kernels[part.split()[0]] = {
                name: int(re.search(rf"^; {what}: (\d+)", part, re.M).group(1)) for name, what in FIGURES.items()}
        return kernels


def takes_more(f, g):
    return (-f["waves"], f["scratch"], f["VGPR"]) > (-g["waves"], g["scratch"], g["VGPR"])


def row(file, kernel, defines, f):
    shown = " ".join((kernel, *defines))
    return f"| {file}: {shown} | {f['VGPR']} | {f['SGPR']} | {f['scratch']} | {f['local']} | {f['waves']} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="kernel files such as nn/conv_gpu.cl; none: all")
    parser.add_argument("--gpu", default="gfx906", help="AMD's name of the processor")
    parser.add_argument("--into", type=pathlib.Path, help="a document that has the marks: what stands out goes there")
    options = parser.parse_args()
    wanted = [v for v in variants() if not options.files or v[0] in options.files]
    if not wanted:
        parser.error(f"no kernel file of a GPU is named {' or '.join(options.files)}")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lambda v: compiled(options.gpu, *v), wanted))
    worst, faults, spilling = {}, [], set()
    for (file, defines), result in zip(wanted, results):
        if isinstance(result, str):
            faults.append(f"{file} {' '.join(defines)}: {result}")
            continue
        for kernel, f in result.items():
            if (file, kernel) not in worst or takes_more(f, worst[file, kernel][1]):
                worst[file, kernel] = (defines, f)
            if f["scratch"] > 0:
                spilling.add((kernel, f["scratch"]))
                if kernel not in SPILLS:
                    faults.append(f"{file}: {kernel} {' '.join(defines)} keeps {f['scratch']} bytes in scratch")
    rows = [(file, kernel, defines, f) for (file, kernel), (defines, f) in worst.items()]
    head = [f"| kernel | VGPR | SGPR | scratch [bytes] | local [bytes] | waves |", "|---|---:|---:|---:|---:|---:|"]
    print("\n".join(head + [row(*r) for r in rows]))
    if options.into:
        notable = [r for r in rows if r[3]["scratch"] > 0 or r[3]["local"] > 0 or r[3]["VGPR"] > 64]
        said = [f"{len(rows)} kernels for {options.gpu}, each with the defines that leave fewest waves; below are those with "
                f"local memory, scratch, or more than 64 registers. {len({k for k, _ in spilling})} keep numbers in scratch"
                + (": " + "; ".join(f"{k} {b} bytes ({SPILLS.get(k, 'unexplained')})" for k, b in sorted(spilling))
                   if spilling else "") + ".", ""]
        text = options.into.read_text()
        if MARK not in text or END not in text:
            parser.error(f"{options.into} has no lines {MARK} and {END}")
        before, after = text.split(MARK)[0], text.split(END)[1]
        options.into.write_text(before + "\n".join([MARK, *said, *head, *[row(*r) for r in notable], END]) + after)
    for fault in faults:
        print(fault, file=sys.stderr)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
