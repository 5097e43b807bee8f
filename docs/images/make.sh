#!/usr/bin/env bash
# Makes the pictures of README.md and docs/rendering.md anew: docs/images/make.sh [program]
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
fathom=${1:-build/release/apps/fathom/fathom}
images=docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
draw() { "$fathom" render "$@" --samples 2 --gpu software --quiet; }
# to_jpeg <output> <ffmpeg input and filter>…
to_jpeg() { local out=$1; shift; ffmpeg -y -loglevel error "$@" -frames:v 1 -q:v 3 "$images/$out"; }

draw drift --bodies 1000 --at 5 --size 640x360 --zoom 1.3 -o "$work/drift.png"
draw layers --bodies 5000 --at 7 --size 640x360 --elevation 14 --zoom 1.3 -o "$work/layers.png"
draw spread --at 5 --size 640x360 --bodies 900 --zoom 1.1 -o "$work/spread.png"
draw pyramid --layers 15 --at 30 --size 640x360 -o "$work/pyramid.png"
for name in drift layers spread pyramid; do to_jpeg "$name.jpg" -i "$work/$name.png"; done

for simulator in native device; do
  draw pyramid --layers 10 --simulator "$simulator" --at 0,10,20,30 --size 320x180 -o "$work/$simulator"
done
to_jpeg strip.jpg -pattern_type glob -i "$work/native/*.png" -pattern_type glob -i "$work/device/*.png" \
  -filter_complex "[0]tile=4x1:padding=4:color=white[n];[1]tile=4x1:padding=4:color=white[d];[n][d]vstack"
draw pyramid --layers 6 --at 2 --size 640x360 --contacts -o "$work/contacts.png"
to_jpeg contacts.jpg -i "$work/contacts.png"
draw layers --bodies 400 --at 3 --size 640x360 --look water -o "$work/water.png"
to_jpeg water.jpg -i "$work/water.png"
