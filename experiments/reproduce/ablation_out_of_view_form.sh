#!/usr/bin/env bash
# Light out of view: the paper's field, the field with a colour behind it, painted spheres.
# minutes: 30
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_out_of_view_form.toml "$@"
