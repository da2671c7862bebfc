#!/bin/sh
# Measures the accelerators and draws the pictures and tables of docs/performance.md.
# usage: tools/performance.sh BUILD_FOLDER SCENES [RESULTS]
#   SCENES   a folder with sionna/munich/munich.xml and indoor/classroom/scene.xml
#   RESULTS  where the measurements are kept as CSV, bench/results if left out; what is there already is not measured again
# Some 40 minutes on an idle core.
set -e
here=$(dirname "$0")
build=${1:?a build folder is needed}
scenes=${2:?a folder with scenes is needed}
results=${3:-$here/../bench/results}
bench=$build/bench/keller-bench-accel
keller=$build/src/cli/keller
cities=$(mktemp -d)
trap 'rm -rf "$cities"' EXIT
mkdir -p "$results"

measure() { # NAME ARGUMENTS...
    measure_with "$bench" "$@"
}

measure_with() { # PROGRAM NAME ARGUMENTS...
    program=$1 name=$results/$2.csv
    shift 2
    [ -s "$name" ] && return
    echo "measuring $name" >&2
    "$program" --csv "$@" > "$name.part"
    mv "$name.part" "$name"
}
munich="--scene $scenes/sionna/munich/munich.xml"

measure munich $munich --peer embree --queries 200000
measure classroom --scene "$scenes/indoor/classroom/scene.xml" --peer embree --queries 200000
for n in 10000 100000 1000000; do
    [ -s "$results/city-$n.csv" ] && [ -s "$results/ubvh.csv" ] && [ -s "$results/ubvh-kinds.csv" ] && [ -s "$results/masks.csv" ] && [ -s "$results/batch.csv" ] && continue
    "$keller" scene generate city --triangles $n -o "$cities/city-$n.obj"
    [ $n = 10000 ] || measure city-$n --scene "$cities/city-$n.obj" --peer embree --queries 100000
done
measure random-1000000 --random 1000000 --peer embree --queries 100000

measure growth --random 10000 --random 100000 --random 1000000 --random 10000000 --structure bvh --structure bvh8 --half-angle -1 \
    --kind random --query nearest --queries 10000 --peer embree

# the paper's figures, on munich: primary cones
for cost in 0.125 0.25 0.5 1 2 4 8; do measure cost-$cost $munich --kind primary --cost $cost --query nearest --queries 50000; done
for order in slabs exact directrix midpoint; do
    measure order-$order $munich --kind primary --order $order --query nearest --structure bvh --queries 50000
done
for yes in yes no; do
    measure contained-$yes $munich --kind primary --contained $yes --query all --structure bvh --structure bvh8 --queries 50000
done
measure leaf-no $munich --kind primary --query all --structure bvh8 --queries 50000
measure leaf-yes $munich --kind primary --query all --structure bvh8 --leaf-boxes --queries 50000
measure walk $munich --kind primary --query walk --queries 50000

classroom="--scene $scenes/indoor/classroom/scene.xml" city="--scene $cities/city-100000.obj" million="--scene $cities/city-1000000.obj"
town="--scene $cities/city-10000.obj"
measure_with "$build/bench/keller-bench-masks" masks $munich $classroom $town $city $million --hair 10000 --queries 30000
measure_with "$build/bench/keller-bench-masks" masks-bvh $munich --hair 1000 --structure bvh --queries 10000
kinds=
for kind in ubvh ubvh-skewed ubvh-ploc ubvh-greedy ubvh-4 sobb sobb-4 obb dop14; do kinds="$kinds --structure $kind"; done
measure ubvh-kinds $munich $classroom $town $city --hair 10000 --structure bvh8 $kinds --query nearest --half-angle -1 --queries 20000
measure ubvh $munich $classroom $town $city $million --hair 10000 --structure bvh8 --structure ubvh --queries 10000
if [ ! -s "$results/batch.csv" ]; then
    batch=$build/bench/keller-bench-batch
    measure_with "$batch" batch-munich $munich --queries 1e7
    measure_with "$batch" batch-rays $classroom $city $million --random 10000 --random 1000000 --hair 10000
    measure_with "$batch" batch-thin $munich $city $million --half-angle 0.5 --queries 1e5
    measure_with "$batch" batch-wide $munich $city --half-angle 5 --queries 1e5
    awk 'NR == 1 || FNR > 1' "$results"/batch-munich.csv "$results"/batch-rays.csv "$results"/batch-thin.csv "$results"/batch-wide.csv \
        > "$results/batch.csv"
    rm "$results"/batch-*.csv
fi

nexthit=$results/nexthit.csv
if [ ! -s "$nexthit" ]; then
    echo "measuring $nexthit" >&2
    "$build/bench/keller-bench-nexthit" --csv $munich --scene "$scenes/indoor/classroom/scene.xml" --layers 128 --rays 10000 \
        --peer embree > "$nexthit.part"
    mv "$nexthit.part" "$nexthit"
fi

"${PYTHON:-python3}" "$here/performance.py" "$results" "$here/../docs"
