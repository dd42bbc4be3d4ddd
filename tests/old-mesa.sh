#!/usr/bin/env bash
# Renders every scene of assets/ on Debian 12's own Mesa 22.3.6, unpacked beside the installed one, and compares with the
# installed driver's picture: at most 1e-4 off on average. Needs apt (Debian 12), a built target/release/raytree.
set -euo pipefail
cd "$(dirname "$0")/.."
raytree=target/release/raytree
folder=target/tmp/mesa-22.3.6
mkdir -p "$folder/pictures"

if [ ! -e "$folder/icd.json" ]; then
  (cd "$folder" && apt-get download mesa-vulkan-drivers=22.3.6-1+deb12u2 && dpkg -x mesa-vulkan-drivers_22.3.6-*.deb .)
  sed "s#/usr/lib#$PWD/$folder/usr/lib#" "$folder"/usr/share/vulkan/icd.d/lvp_icd*.json >"$folder/icd.json"
fi

old() { VK_DRIVER_FILES="$PWD/$folder/icd.json" VK_ICD_FILENAMES="$PWD/$folder/icd.json" "$raytree" "$@"; }

"$raytree" devices
old devices
failed=0
for scene in assets/*.glb assets/*.gltf; do
  name=$(basename "${scene%.*}")
  for shading in pbr whitted; do
    "$raytree" render -q "$scene" --size 320x240 --shading "$shading" -o "$folder/pictures/$name-$shading-new.exr"
    old render -q "$scene" --size 320x240 --shading "$shading" -o "$folder/pictures/$name-$shading-old.exr"
    printf '%-16s %-8s ' "$name" "$shading"
    "$raytree" compare --no-flip --max-mean 1e-4 "$folder/pictures/$name-$shading-new.exr" \
      "$folder/pictures/$name-$shading-old.exr" | tr '\n' ' ' || failed=1
    echo
  done
done
exit $failed
