#!/usr/bin/env bash
# Makes sure that this machine can run raytree: a Vulkan loader and Mesa's lavapipe (Vulkan on the CPU).
#
# Idempotent: the second run changes nothing. Prints what it does and what it found. Installs from the system's own
# package manager only; on a system it does not know it says what to install by hand and exits with 1.
#
#   ./setup.sh            check, install what is missing
#   ./setup.sh --check    only check: exit 0 if all is there, 1 if not; changes nothing
set -euo pipefail

# The Mesa that golden pictures and benches are pinned to. Older ones render too (ARCHITECTURE.md, "Drivers").
readonly WANTED_MESA=25.0.7
readonly ICD_FOLDERS="/usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d"

say() { printf 'setup: %s\n' "$*"; }
fail() { printf 'setup: %s\n' "$*" >&2; exit 1; }

# Runs a command as root, with sudo where we are not root already.
as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"
  elif command -v sudo >/dev/null; then sudo "$@"
  else fail "needs root for: $*  (run this script as root, or install sudo)"
  fi
}

ldconfig_path() { command -v ldconfig || echo /sbin/ldconfig; }

# (grep without -q: it has to read to the end, or ldconfig dies of a broken pipe and pipefail reports that.)
loader_found() { "$(ldconfig_path)" -p 2>/dev/null | grep 'libvulkan\.so\.1' >/dev/null; }

# Prints the path of lavapipe's driver manifest, if there is one.
lavapipe_manifest() {
  local folder manifest
  for folder in $ICD_FOLDERS; do
    for manifest in "$folder"/lvp_icd*.json; do
      if [ -e "$manifest" ]; then printf '%s\n' "$manifest"; return 0; fi
    done
  done
  return 1
}

# Prints Mesa's version as the package manager knows it ("25.0.7"), or nothing.
mesa_version() {
  if command -v dpkg-query >/dev/null; then
    dpkg-query -W -f='${Version}' mesa-vulkan-drivers 2>/dev/null | sed 's/^[0-9]*://; s/[-+~].*//'
  elif command -v rpm >/dev/null; then
    rpm -q --qf '%{VERSION}' mesa-vulkan-drivers 2>/dev/null || true
  elif command -v pacman >/dev/null; then
    pacman -Q vulkan-swrast 2>/dev/null | sed 's/.* \([0-9]*:\)\{0,1\}//; s/-.*//'
  elif command -v apk >/dev/null; then
    apk list -I 2>/dev/null | sed -n 's/^mesa-vulkan-swrast-\([0-9.]*\)-.*/\1/p'
  fi
}

# at_least A B: is version A the same as B or newer?
at_least() { [ "$(printf '%s\n%s\n' "$2" "$1" | sort -V | head -n 1)" = "$2" ]; }

# A driver that is there and new enough. A Mesa of unknown version (built by hand) is taken as it is.
driver_good() {
  local version
  loader_found && lavapipe_manifest >/dev/null || return 1
  version=$(mesa_version)
  [ -z "$version" ] || at_least "$version" "$WANTED_MESA"
}

report() {
  say "Vulkan loader: $("$(ldconfig_path)" -p | sed -n '0,/libvulkan\.so\.1/s/.*libvulkan\.so\.1.* => //p')"
  say "lavapipe:      $(lavapipe_manifest) (Mesa $(mesa_version || true))"
  if command -v cargo >/dev/null; then say "Rust:          $(cargo --version)"
  else say "Rust:          not found; install it with rustup (https://rustup.rs), version 1.95 or newer"
  fi
}

# Debian 12 has Mesa 22.3.6; 25.0.7 is in its backports, which may have to be named first.
debian_backports() {
  local codename=$1 file=/etc/apt/sources.list.d/raytree-backports.sources
  if apt-cache policy 2>/dev/null | grep "n=$codename-backports" >/dev/null; then return; fi
  say "adding Debian's $codename-backports to apt: $file"
  as_root tee "$file" >/dev/null <<SOURCES
Types: deb
URIs: http://deb.debian.org/debian
Suites: $codename-backports
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
SOURCES
}

install_with_apt() {
  local id=$1 codename=$2 from=()
  export DEBIAN_FRONTEND=noninteractive
  if [ "$id" = debian ] && [ "$codename" = bookworm ]; then
    debian_backports "$codename"
    from=(-t "$codename-backports")
  fi
  say "apt-get update"
  # A third-party source that is down must not stop us: the install below says whether what we need was found.
  as_root apt-get update -qq || say "apt-get update reported errors; going on with what is there"
  say "apt-get install libvulkan1 mesa-vulkan-drivers ${from[*]:-}"
  as_root apt-get install -y -qq --no-install-recommends "${from[@]}" libvulkan1 mesa-vulkan-drivers
  # The crate nv-flip builds a little C++.
  command -v c++ >/dev/null || as_root apt-get install -y -qq --no-install-recommends g++
}

install_driver() {
  local id="" like="" codename=""
  if [ -r /etc/os-release ]; then
    # shellcheck disable=SC1091
    id=$(. /etc/os-release && echo "${ID:-}")
    like=$(. /etc/os-release && echo "${ID_LIKE:-}")
    codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  fi
  case " $id $like " in
    *" debian "* | *" ubuntu "*) install_with_apt "$id" "$codename" ;;
    *" fedora "* | *" rhel "*) as_root dnf install -y vulkan-loader mesa-vulkan-drivers gcc-c++ ;;
    *" arch "*) as_root pacman -S --needed --noconfirm vulkan-icd-loader vulkan-swrast gcc ;;
    *" alpine "*) as_root apk add vulkan-loader mesa-vulkan-swrast g++ ;;
    *)
      fail "I do not know how to install packages on this system (${id:-no /etc/os-release}).
  Install by hand: a Vulkan loader (libvulkan.so.1), Mesa's lavapipe (Mesa $WANTED_MESA or newer) and a C++ compiler.
  They are called libvulkan1, mesa-vulkan-drivers and g++ on Debian and Ubuntu. Then run ./setup.sh again."
      ;;
  esac
}

main() {
  case "${1:-}" in
    "") ;;
    --check) if driver_good; then report; exit 0; else fail "no Vulkan loader with lavapipe $WANTED_MESA or newer found; run ./setup.sh"; fi ;;
    *) fail "unknown argument '$1'; usage: ./setup.sh [--check]" ;;
  esac
  if driver_good && command -v c++ >/dev/null; then
    say "all there, nothing to do"
  else
    install_driver
    loader_found || fail "still no Vulkan loader (libvulkan.so.1) after installing; see the messages above"
    lavapipe_manifest >/dev/null || fail "still no lavapipe (lvp_icd*.json in $ICD_FOLDERS); see the messages above"
    version=$(mesa_version)
    if [ -n "$version" ] && ! at_least "$version" "$WANTED_MESA"; then
      say "note: this system gives Mesa $version, older than $WANTED_MESA. Pictures are right, the golden tests may differ."
    fi
  fi
  report
}

main "$@"
