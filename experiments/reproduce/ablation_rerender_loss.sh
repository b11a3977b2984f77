#!/usr/bin/env bash
# The light trained with and without the re-rendering loss.
# minutes: 50
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_rerender_loss.toml "$@"
