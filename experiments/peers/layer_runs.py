"""Seconds of `clerestory bench layer`, for the programs that run beside it."""
import json
import os
import subprocess
import sys
import tempfile


def layer_runs(binary, only, runs, *more):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bench.json")
        command = [binary, "bench", "layer", "--quiet", f"--runs={runs}", f"--only={only}", f"--json={path}", *more]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: {done.stderr.strip()}")
        with open(path, encoding="utf-8") as file:
            return json.load(file)["layer"]["rows"][0]["runs"]
