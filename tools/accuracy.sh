#!/bin/sh
# Draws the pictures of docs/accuracy.md from keller-bench-accuracy and the tables of exact fields.
# usage: tools/accuracy.sh BUILD_FOLDER TRUTH_FOLDER [PICTURE_FOLDER, docs if left out]
set -e
here=$(dirname "$0")
build=${1:?a build folder is needed}
truth=${2:?the folder of the tables of exact fields is needed}
out=${3:-$here/../docs}
data=$(mktemp -d)
trap 'rm -rf "$data"' EXIT
"$build"/bench/keller-bench-accuracy --csv --truth "$truth" --curves "$data" > "$data/accuracy-all.csv"
gnuplot --default-settings -e "data='$data/accuracy-'; out='$out/accuracy-'" "$here/accuracy.gp"
