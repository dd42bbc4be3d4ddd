#!/bin/sh
# Makes the diagrams of this folder again: error against run time of our own scenes. All of them take some fifteen minutes on two
# cores that have nothing else to do; `benches/converge/draw.sh whitted-1980 book` makes these alone.
set -eu
cd "$(dirname "$0")/../.."
cargo build --release
if [ $# -eq 0 ]; then
    set -- $(ls assets/*.glb assets/*.gltf | xargs -n 1 basename | sed 's/\.gl.*//')
fi
for name in "$@"; do
    scene=$(ls "assets/$name.glb" "assets/$name.gltf" 2>/dev/null | head -n 1)
    out="target/converge/$name"
    target/release/raytree converge "$scene" -o "$out" --fresh
    cp "$out/converge.svg" "benches/converge/$name.svg"
    cp "$out/converge.csv" "benches/converge/$name.csv"
done
