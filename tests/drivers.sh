#!/usr/bin/env bash
# The same work on other drivers than the installed one: Debian 12's own Mesa 22.3.6 and SwiftShader (in Debian's
# chromium-common), unpacked beside it, not installed. Needs apt (Debian 12) and a built raytree.
#
#   tests/drivers.sh pictures   every scene of assets/, both models: at most 1e-4 off the installed driver's picture on average
#   tests/drivers.sh stress     the stress suite on each driver; tables in target/tmp/drivers/stress-DRIVER.md
#   tests/drivers.sh compiled   Mesa 22.3.6 compiles a kernel once, not for each dispatch (see loop_end in shaders/state.wgsl)
#   tests/drivers.sh            all of it
#
# RAYTREE=path picks another program than target/release/raytree.
set -euo pipefail
cd "$(dirname "$0")/.."
raytree=${RAYTREE:-target/release/raytree}
folder=$PWD/target/tmp/drivers
mkdir -p "$folder/pictures"
failed=0

# unpack NAME PACKAGE LIBRARY MANIFEST: makes $folder/NAME.json, a manifest of the driver that lies in an unpacked package.
unpack() {
  local name=$1 package=$2 library=$3 manifest=$4
  if [ -e "$folder/$name.json" ]; then return; fi
  mkdir -p "$folder/$name"
  (cd "$folder/$name" && apt-get download "$package" && dpkg -x ./*.deb . && rm ./*.deb)
  sed "s#\"library_path\": \"[^\"]*\"#\"library_path\": \"$folder/$name/$library\"#" \
    "$folder/$name"/$manifest >"$folder/$name.json"
}

# on DRIVER COMMAND...: with that driver alone; "installed" is whatever the system has.
on() {
  local driver=$1
  shift
  if [ "$driver" = installed ]; then "$@"
  else VK_DRIVER_FILES="$folder/$driver.json" VK_ICD_FILENAMES="$folder/$driver.json" "$@"
  fi
}

pictures() {
  local scene name shading driver
  for scene in assets/*.glb assets/*.gltf; do
    name=$(basename "${scene%.*}")
    for shading in pbr whitted; do
      for driver in installed mesa-22.3.6 swiftshader; do
        on "$driver" "$raytree" render -q "$scene" --size 320x240 --shading "$shading" \
          -o "$folder/pictures/$name-$shading-$driver.exr"
      done
      for driver in mesa-22.3.6 swiftshader; do
        printf '%-16s %-8s %-12s ' "$name" "$shading" "$driver"
        "$raytree" compare --no-flip --max-mean 1e-4 "$folder/pictures/$name-$shading-installed.exr" \
          "$folder/pictures/$name-$shading-$driver.exr" | tr '\n' ' ' || failed=1
        echo
      done
    done
  done
}

# Without the driver's cache, kernels that are compiled anew for each dispatch make rendering take many times as long as compiling them
# once: a dozen iterations of a quarter of a second each.
compiled() {
  local scene flags times
  for scene in assets/*.glb assets/*.gltf; do
    for flags in '' '--tolerance 0.05'; do
      # shellcheck disable=SC2086
      times=$(MESA_SHADER_CACHE_DISABLE=true on mesa-22.3.6 "$raytree" render "$scene" --size 64x48 $flags --json \
        -o "$folder/pictures/compiled.png" 2>/dev/null | tr -d ' \n' | grep -o '"time_ms":{[^}]*}' |
        grep -o '"\(compile\|render\)":[0-9.]*' | tr '\n' ' ')
      printf '%-16s %-16s %s\n' "$(basename "${scene%.*}")" "$flags" "$times"
      tr ' ' '\n' <<<"$times" |
        awk -F: '{ took[$1] = $2 } END { exit !(took["\"render\""] < took["\"compile\""]) }' || failed=1
    done
  done
}

stress() {
  local driver
  for driver in installed mesa-22.3.6 swiftshader; do
    on "$driver" "$raytree" stress --markdown >"$folder/stress-$driver.md" || failed=1
    echo "$driver: $(tail -n 1 "$folder/stress-$driver.md")"
  done
}

unpack mesa-22.3.6 mesa-vulkan-drivers=22.3.6-1+deb12u2 usr/lib/x86_64-linux-gnu/libvulkan_lvp.so 'usr/share/vulkan/icd.d/lvp_icd*.json'
unpack swiftshader chromium-common usr/lib/chromium/libvk_swiftshader.so usr/lib/chromium/vk_swiftshader_icd.json
for driver in installed mesa-22.3.6 swiftshader; do on "$driver" "$raytree" devices; done
case ${1:-all} in
  pictures) pictures ;;
  compiled) compiled ;;
  stress) stress ;;
  all) pictures; compiled; stress ;;
  *) echo "usage: tests/drivers.sh [pictures|compiled|stress]" >&2; exit 2 ;;
esac
exit $failed
