#!/usr/bin/env bash
# What the least weight of a branch costs and saves: of every scene in assets/, 128 x 96 pixels, one sample, the rays with 1/256 and with
# 1/1000; how far both pictures are from the one with all branches; and how far that one is from a picture of 196 samples a pixel (weights
# down to 0.0005). Root mean square of what a screen shows (clipped to 1). A minute or two.
#
#   benches/tools/least_weight.sh        RAYTREE=path picks another program than target/release/raytree
set -euo pipefail
cd "$(dirname "$0")/../.."
raytree=${RAYTREE:-target/release/raytree}
folder=target/tmp/least-weight
mkdir -p "$folder"

# render NAME FILE FLAGS...
render() {
  local name=$1 file=$2
  shift 2
  "$raytree" render -q "$file" --size 128x96 "$@" -o "$folder/$name.exr"
}

rays() {
  "$raytree" render "$1" --size 128x96 --min-weight "$2" --counters --json -o "$folder/counted.png" 2>/dev/null |
    tr -d ' \n' | grep -o '"rays":{[^}]*}' | grep -o '[0-9]\+' | awk '{ sum += $1 } END { print sum }'
}

rmse() {
  "$raytree" compare --no-flip --clip "$folder/$1.exr" "$folder/$2.exr" | awk '/^rmse/ { print $2 }'
}

printf '%-16s %10s %10s %10s %10s %10s\n' scene 'rays 1/256' 1/1000 'off 1/256' 1/1000 'a sample'
for file in assets/*.glb assets/*.gltf; do
  name=$(basename "${file%.*}")
  render 256 "$file" --min-weight 0.00390625
  render 1000 "$file" --min-weight 0.001
  render all "$file" --min-weight 0
  render samples "$file" --min-weight 0.0005 --spp 196
  printf '%-16s %10s %10s %10s %10s %10s\n' "$name" "$(rays "$file" 0.00390625)" "$(rays "$file" 0.001)" \
    "$(rmse all 256)" "$(rmse all 1000)" "$(rmse samples all)"
done
