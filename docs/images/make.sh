#!/usr/bin/env bash
# Renders the pictures of the documents: docs/images/make.sh [program]
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
fathom=${1:-build/release/apps/fathom/fathom}
images=docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
draw() { "$fathom" render "$@" --samples 2 --gpu software --quiet; }
# to_jpeg <output> <ffmpeg input and filter>…
to_jpeg() { local out=$1; shift; ffmpeg -y -loglevel error "$@" -frames:v 1 -q:v 4 "$images/$out"; }

# README.md: balls, capsules, boxes and hulls fall on each other.
draw mixed --bodies 1000 --at 1.4 --zoom 1.9 --size 960x540 -o "$work/mixed.png"
to_jpeg mixed.jpg -i "$work/mixed.png"

# docs/results.md: the pyramid over 30 s, native above, device below.
for simulator in native device; do
  draw pyramid --layers 10 --simulator "$simulator" --at 0,10,20,30 --size 320x180 -o "$work/$simulator"
done
to_jpeg strip.jpg -pattern_type glob -i "$work/native/*.png" -pattern_type glob -i "$work/device/*.png" \
  -filter_complex "[0]tile=4x1:padding=4:color=white[n];[1]tile=4x1:padding=4:color=white[d];[n][d]vstack"

# docs/rendering.md: overlays and looks.
draw pyramid --layers 6 --at 2 --size 640x360 --contacts -o "$work/contacts.png"
to_jpeg contacts.jpg -i "$work/contacts.png"
draw layers --bodies 400 --at 3 --size 640x360 --look water -o "$work/water.png"
to_jpeg water.jpg -i "$work/water.png"
