#!/bin/sh
# Draws the pictures of docs/numerics.md from the sweeps of keller-bench-stability.
# usage: tools/numerics.sh BUILD_FOLDER [PICTURE_FOLDER, docs if left out]
set -e
here=$(dirname "$0")
build=${1:?a build folder is needed}
out=${2:-$here/../docs}
data=$(mktemp -d)
trap 'rm -rf "$data"' EXIT
"$build"/bench/keller-bench-stability --sweeps "$data"
gnuplot --default-settings -e "data='$data/numerics-'; out='$out/numerics-'" "$here/numerics.gp"
