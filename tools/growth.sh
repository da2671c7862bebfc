#!/bin/sh
# Measures how the cost of whole runs grows with triangles, orders, receivers and cells; table and picture of docs/performance.md.
# usage: tools/growth.sh BUILD_FOLDER [RESULTS]
#   RESULTS  where the measurements are kept as CSV, bench/results if left out; what is there already is not measured again
# Some 20 minutes on an idle core.
set -e
here=$(dirname "$0")
bench=${1:?a build folder is needed}/bench/keller-bench-paths
results=${2:-$here/../bench/results}
mkdir -p "$results"

measure() { # NAME ARGUMENTS...
    name=$results/growth-$1.csv
    shift
    [ -s "$name" ] && return
    echo "measuring $name" >&2
    "$bench" --csv --threads 1 "$@" > "$name.part"
    mv "$name.part" "$name"
}

measure triangles --city 1000 --city 10000 --city 100000 --city 1000000 --receivers 10 --orders 2,1,2
measure orders --city 10000 --receivers 10 --orders 1,1,1 --orders 2,1,2 --orders 3,1,3 --orders 4,1,4
measure receivers --city 10000 --orders 1,1,1 --receivers 10 --receivers 100 --receivers 1000 --receivers 10000 --receivers 100000
measure searched --city 10000 --orders 2,1,2 --receivers 1 --receivers 10 --receivers 100 --receivers 1000
measure cells --city 10000 --orders 1,1,1 --cells 10 --cells 100 --cells 1000 --cells 10000 --cells 100000

"${PYTHON:-python3}" "$here/growth.py" "$results" "$here/../docs"
