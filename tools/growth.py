"""How the cost of whole runs grows: table and picture of docs/performance.md from the measurements of tools/growth.sh.

usage: growth.py RESULTS DOCS
Replaces what stands between `<!-- whole-growth -->` and `<!-- end -->` in DOCS/performance.md; draws DOCS/performance-whole-growth.png
with gnuplot. An exponent is the slope of the straight line fitted by least squares to the logarithms of the last three points, as what a
run costs before it looks at anything hides the growth of small ones."""
import csv
import math
import os
import re
import subprocess
import sys

LAST = 3
SERIES = [("triangles", "triangles", "triangles of a city, 10 receivers, orders 2, 1, 2"),
          ("orders", "interactions", "reflections and interactions, 1 diffraction, city of 10⁴, 10 receivers"),
          ("receivers", "receivers", "receivers, city of 10⁴, orders 1, 1, 1: sifted from the transmitter's side"),
          ("searched", "receivers", "receivers, city of 10⁴, orders 2, 1, 2: each searches"),
          ("cells", "receivers", "cells of a map, city of 10⁴, orders 1, 1, 1")]


def read(results, name):
    with open(os.path.join(results, f"growth-{name}.csv"), newline="") as f:
        return [row for row in csv.DictReader(f) if row["cpu_s"]]


def exponent(rows, x, y):
    points = [(math.log(float(r[x])), math.log(float(r[y]))) for r in rows[-LAST:] if float(r[y]) > 0]
    n = len(points)
    mean_x, mean_y = (sum(p[i] for p in points) / n for i in (0, 1))
    return sum((a - mean_x) * (b - mean_y) for a, b in points) / sum((a - mean_x) ** 2 for a, _ in points)


def table(tables):
    out = ["| what grows | | processor, s | cones | candidates | paths | peak, MB |", "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for name, x, title in SERIES:
        rows = tables[name]
        for i, r in enumerate(rows):
            cells = [f"{float(r[k]):.3g}" if k == "cpu_s" else f"{int(r[k]):,}" for k in ("cpu_s", "cones", "candidates", "paths", "peak_mb")]
            out.append("| " + " | ".join([title if i == 0 else "", f"{int(r[x]):,}", *cells]) + " |")
        if x == "interactions":
            out.append("| *factor from one order to the next, the last two* | | " + " | ".join(
                f"*{(float(rows[-1][k]) / float(rows[-3][k])) ** 0.5:.2g}*" for k in ("cpu_s", "cones", "candidates", "paths", "peak_mb")) + " |")
        else:
            out.append("| *exponent* | | " + " | ".join(
                f"*{exponent(rows, x, k):.2f}*" for k in ("cpu_s", "cones", "candidates", "paths", "peak_mb")) + " |")
    return out


def insert(page, name, lines):
    with open(page, encoding="utf-8") as f:
        text = f.read()
    begin, end = f"<!-- {name} -->\n", "<!-- end -->"
    changed, n = re.subn(re.escape(begin) + ".*?" + re.escape(end), lambda _: begin + "\n".join(lines) + "\n" + end, text, flags=re.S)
    if n != 1:
        sys.exit(f"growth.py: {page} has no place for {name}")
    with open(page, "w", encoding="utf-8") as f:
        f.write(changed)


def draw(tables, docs):
    script = ["set terminal pngcairo size 1000,400 font 'sans,10' background 'white'",
              f"set output '{docs}/performance-whole-growth.png'", "set multiplot layout 1,2 margins 0.075,0.985,0.15,0.92 spacing 0.09",
              "set grid lc rgb '#d0d0d0'", "set border 3 lc rgb '#606060'", "set tics nomirror out", "set key bottom right Left reverse",
              "set logscale xy", "set format x '10^{%T}'", "set format y '10^{%T}'", "set ylabel 'processor time, s'"]
    plots = []
    for name, x, _ in SERIES:
        rows = tables[name]
        data = "\n".join(f"{r[x]} {r['cpu_s']}" for r in rows)
        script.append(f"${name} << EOD\n{data}\nEOD")
        slope = "" if x == "interactions" else f", n^{{{exponent(rows, x, 'cpu_s'):.2f}}}"
        plots.append(f"${name} using 1:2 with linespoints lw 2 pt 7 ps 0.8 title '{name}{slope}'")
    script += ["set xlabel 'triangles, receivers or cells'", "plot " + ", ".join([plots[0], *plots[2:]]), "unset logscale x",
               "set format x '%g'", "set xrange [0.8:4.2]", "set xtics 1", "set xlabel 'reflections and interactions at most, one diffraction'",
               f"plot {plots[1]}"]
    subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: growth.py RESULTS DOCS")
    tables = {name: read(sys.argv[1], name) for name, _, _ in SERIES}
    insert(os.path.join(sys.argv[2], "performance.md"), "whole-growth", table(tables))
    draw(tables, sys.argv[2])


main()
