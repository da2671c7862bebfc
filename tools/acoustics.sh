#!/bin/sh
# Draws the picture of docs/acoustics.md in which the two methods of diffraction are compared.
# usage: tools/acoustics.sh BUILD_FOLDER [PICTURE, docs/acoustics-methods.png if left out]
set -e
here=$(dirname "$0")
build=${1:?a build folder is needed}
out=${2:-$here/../docs/acoustics-methods.png}
data=$(mktemp)
trap 'rm -f "$data"' EXIT
"$build"/bench/keller-bench-acoustics --csv > "$data"
gnuplot --default-settings -e "data='$data'; out='$out'" "$here/acoustics.gp"
