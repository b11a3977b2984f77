#!/usr/bin/env bash
# The Debian package in an empty Debian 12 without the source tree and, once installed, without a network: an unprivileged
# user takes a photograph apart, puts things into it, makes rooms and trains both nets for ten steps. Prints what it runs.
# Needs root, a Debian mirror, 2 GB below TMPDIR (/var/tmp) and some five minutes.   usage: bash tests/installed.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
packages+=(debootstrap dpkg-dev file)
install_packages
build clerestory
box=$(mktemp -d "${TMPDIR:-/var/tmp}/clerestory-box.XXXXXX")
chmod 755 "$box"
trap 'rm -rf --one-file-system "$box"' EXIT # what is mounted in it ended with its namespace

# inside [OPTION OF unshare]... -- COMMAND...: in the box, in namespaces of its own.
inside() {
  local isolation=()
  while [ "$1" != -- ]; do isolation+=("$1") && shift; done
  shift
  unshare --mount --pid --fork --kill-child "${isolation[@]}" bash -c \
    'mount -t proc proc "$0/proc" && mount -t sysfs -o ro sysfs "$0/sys" && exec chroot "$0" "$@"' "$box" "$@"
}
# The same as somebody who may write in their home alone.
visit() {
  local start=$SECONDS
  echo "\$ $*"
  inside --net -- runuser -u visitor -- env -i HOME=/home/visitor PATH=/usr/bin:/bin \
    bash -c 'cd && "$@"' visit "$@" 2>&1 | tee -a "$box/said"
  echo "  ($((SECONDS - start)) s)"
}

(cd "$root/build" && cpack -G DEB -B "$box.package" >/dev/null)
debootstrap --variant=minbase bookworm "$box" http://deb.debian.org/debian >"$box.log" || { tail "$box.log" && exit 1; }
rm "$box.log"
mv "$box.package"/*.deb "$box/clerestory.deb" && rm -r "$box.package"
inside -- sh -c 'apt-get update -qq && apt-get install -y --no-install-recommends /clerestory.deb >/installed 2>&1 ||
  { tail /installed && exit 1; }'
inside -- useradd --create-home visitor

rooms=('data.train=["rooms"]' data.train_split=train data.validation_split=train train.steps=10)
visit clerestory devices
visit cp /usr/share/clerestory/assets/real/office/rgb.png photo.png
visit clerestory invert photo.png --fov 60 --out room
visit clerestory insert room --at 330,400 --radius 0.25 --roughness 0.02 --metallic 1 \
  --at 200,420 --mesh assets/models/bunny.glb --size 0.4
visit clerestory light room --at 330,400 --size 64x32 --out probe.exr
visit clerestory generate --out rooms --rooms 2 --views 1 --size 64x48 --spp 4
visit clerestory train experiments/configs/mgnet_compact.toml "${rooms[@]}" model.width=64 model.height=32
visit clerestory train experiments/configs/light_compact.toml "${rooms[@]}" model.width=64 model.height=48
for made in room/report.html room/composite.png probe.exr; do visit test -s $made; done
[ "$(find "$box/home/visitor/runs" -name weights.safetensors | wc -l)" -eq 2 ]
if grep -E 'warnings? generated' "$box/said"; then exit 1; fi
echo "The installed program works without the source tree."
