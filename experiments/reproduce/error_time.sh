#!/usr/bin/env bash
# The error of the Monte Carlo layer and of its gradients against seconds, by estimator.
# minutes: 15
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/error_time.toml "$@" -- --table error_time
