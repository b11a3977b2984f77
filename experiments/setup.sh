# Sourced by the two commands of the README: installs what is missing on Debian 12 and builds into build/.
# Not to be run by itself.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
packages=(g++ cmake ninja-build pkg-config ccache
  opencl-clhpp-headers ocl-icd-opencl-dev pocl-opencl-icd libclblast-dev
  libopenimageio-dev libopenexr-dev zlib1g-dev libtinygltf-dev libdraco-dev libembree-dev libhdf5-dev
  libglm-dev libtomlplusplus-dev libcli11-dev libfmt-dev libspdlog-dev nlohmann-json3-dev libgtest-dev libgmock-dev gnuplot-nox)

install_packages() {
  local missing=() package
  for package in "${packages[@]}"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local line="apt-get install -y --no-install-recommends ${missing[*]}"
  if [ "$(id -u)" -eq 0 ]; then
    echo "Installing: ${missing[*]}"
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive $line >/dev/null
  elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    echo "Installing: ${missing[*]}"
    sudo apt-get update -qq && sudo DEBIAN_FRONTEND=noninteractive $line >/dev/null
  else
    echo "These packages are missing, and installing them needs root. Run this, then try again:" >&2
    echo "  sudo $line" >&2
    exit 1
  fi
}

# build TARGET...: configure once, build what changed.
build() {
  [ -f "$root/build/build.ninja" ] || cmake -S "$root" -B "$root/build" -G Ninja -DCMAKE_BUILD_TYPE=Release >"$root/build.log" 2>&1 ||
    { cat "$root/build.log" >&2; exit 1; }
  rm -f "$root/build.log"
  ninja -C "$root/build" "$@"
}
