#!/usr/bin/env bash
# Says which sources are not as clang-format (Debian 12's, .clang-format) leaves them.   usage: bash tests/format.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
packages=(clang-format)
install_packages
cd "$root"
find checks experiments host nets tests tracer -name '*.[ch]pp' -print0 | xargs -0 clang-format --dry-run -Werror
