"""Tables and pictures of docs/performance.md from the measurements of tools/performance.sh.

usage: performance.py RESULTS DOCS
Replaces what stands between `<!-- NAME -->` and `<!-- end -->` in DOCS/performance.md; draws DOCS/performance-*.png with gnuplot."""
import csv
import glob
import math
import os
import re
import subprocess
import sys

import structures_table

ANGLES = ["-1", "1e-05", "0.1", "0.5", "5", "15"]
LABEL = {"-1": "ray", "1e-05": "10⁻⁵°", "0.1": "0.1°", "0.5": "0.5°", "5": "5°", "15": "15°"}
STRUCTURES = ["kdtree", "bvh", "bvh8"]
SCENES = ["munich", "classroom", "city-100000", "city-1000000", "random-1000000"]
# Issue: the peer's reference table, and what was asked for: ratios to Embree's nearest random ray.
ASKED = {("-1", "nearest"): 1.2, ("-1", "any"): 1.3,
         ("1e-05", "nearest"): 2.75, ("1e-05", "all"): 6, ("1e-05", "any"): 1.75,
         ("0.1", "nearest"): 3.25, ("0.1", "all"): 7.5, ("0.1", "any"): 1.5,
         ("0.5", "nearest"): 4, ("0.5", "all"): 12.5, ("0.5", "any"): 1.55,
         ("5", "nearest"): 15, ("5", "all"): 143, ("5", "any"): 3.1,
         ("15", "nearest"): 127, ("15", "all"): 1167, ("15", "any"): 28}


def read(results):
    tables = {}
    for path in glob.glob(os.path.join(results, "*.csv")):
        with open(path, newline="") as f:
            tables[os.path.basename(path)[:-4]] = list(csv.DictReader(f))
    return tables


def find(rows, **wanted):
    for row in rows:
        if all(row[k] == v for k, v in wanted.items()):
            return row
    return None


def short(text, digits=3):
    value = float(text)
    if value >= 1e6:
        return f"{value / 1e6:.{digits}g}M"
    if value >= 1e4:
        return f"{value / 1e3:.{digits}g}K"
    if value >= 1000:
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def targets(tables):
    out = ["| half-angle | query | kdtree | bvh | bvh8 | asked for | bvh8, µs | nodes | triangles | edges | hits |",
           "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for angle in ANGLES:
        for query in ["nearest", "all", "any"]:
            cells, last = [], None
            for structure in STRUCTURES:
                row = find(tables["munich"], structure=structure, query=query, kind="random", half_angle_deg=angle, eccentricity="0")
                cells.append(short(row["ratio"]))
                last = row
            asked = ASKED.get((angle, query))
            out.append("| " + " | ".join([LABEL[angle], query, *cells, f"{asked:g}" if asked else "", short(last["us_per_query"]),
                                           short(last["nodes"]), short(last["triangles"]), short(last["edges"]),
                                           short(last["hits"])]) + " |")
    return out


def builds(tables):
    out = ["| scene | kdtree, ms | bvh, ms | bvh8, ms | Embree, ms | bvh8 / Embree | bytes a triangle: kdtree | bvh | bvh8 |",
           "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for scene in SCENES:
        rows = tables[scene]
        per = {s: find(rows, structure=s, query="nearest", kind="random", half_angle_deg="-1") for s in STRUCTURES}
        peer = find(rows, structure="embree", kind="random")
        out.append("| " + " | ".join([scene, *(short(per[s]["build_ms"]) for s in STRUCTURES), short(peer["build_ms"]),
                                       short(float(per["bvh8"]["build_ms"]) / float(peer["build_ms"])),
                                       *(short(per[s]["bytes_per_triangle"]) for s in STRUCTURES)]) + " |")
    return out


def growth(tables):
    out = ["| random triangles | bvh, ms | bvh8, ms | Embree, ms | bvh8 / Embree | bvh8: ns a triangle and log₂ *n* |",
           "| --- | ---: | ---: | ---: | ---: | ---: |"]
    rows = tables["growth"]
    for scene in dict.fromkeys(row["scene"] for row in rows):
        n = int(scene.split("-")[1])
        ms = {s: float(find(rows, scene=scene, structure=s)["build_ms"]) for s in ["bvh", "bvh8", "embree"]}
        out.append("| " + " | ".join([f"{n:,}", short(ms["bvh"]), short(ms["bvh8"]), short(ms["embree"]), short(ms["bvh8"] / ms["embree"]),
                                       short(ms["bvh8"] * 1e6 / (n * math.log2(n)))]) + " |")
    return out


def rays(tables):
    out = ["| scene | kind | Embree fast, µs | robust | bvh8 nearest / fast | / robust | bvh8 any / fast | any / robust |",
           "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for scene in SCENES:
        for kind in ["primary", "random"]:
            fast = find(tables[scene], structure="embree", kind=kind)
            robust = find(tables[scene], structure="embree-robust", kind=kind)
            cells = []
            for query in ["nearest", "any"]:
                row = find(tables[scene], structure="bvh8", query=query, kind=kind, half_angle_deg="-1")
                cells += [short(row["ratio"]), short(row["ratio_robust"])]
            out.append("| " + " | ".join([scene, kind, short(fast["us_per_query"]), short(robust["us_per_query"]), *cells]) + " |")
    return out


def paper(tables, kind, eccentricity):
    head = "| structure | half-angle | " + " | ".join(f"{s}: µs | nodes | tris" for s in SCENES) + " |"
    out = [head, "| --- | --- |" + " ---: |" * (3 * len(SCENES))]
    for structure in STRUCTURES:
        for angle in ANGLES:
            cells = []
            for scene in SCENES:
                row = find(tables[scene], structure=structure, query="nearest", kind=kind, half_angle_deg=angle,
                           eccentricity=eccentricity if angle != "-1" else "0")
                every = find(tables[scene], structure=structure, query="all", kind=kind, half_angle_deg=angle,
                             eccentricity=eccentricity if angle != "-1" else "0")
                row = row if angle == "-1" else every
                cells += [short(row["us_per_query"]), short(row["nodes"]), short(row["triangles"])]
            out.append("| " + " | ".join([structure, LABEL[angle], *cells]) + " |")
    return out


def next_hits(results):
    """The tables of tools/nexthit_table.py, by the names of their marks."""
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "nexthit_table.py")
    with open(os.path.join(results, "nexthit.csv"), encoding="utf-8") as f:
        text = subprocess.run([sys.executable, script], stdin=f, capture_output=True, text=True, check=True).stdout
    tables = [part.strip().split("\n") for part in text.split("\n\n") if part.startswith("|")]
    return dict(zip(["next hits", "next hits lost", "next hit ratios"], tables))


def fill(docs, parts):
    path = os.path.join(docs, "performance.md")
    with open(path, encoding="utf-8") as f:
        text = f.read()
    for name, lines in parts.items():
        mark = f"<!-- {name} -->"
        if mark not in text:
            sys.exit(f"performance.py: {path}: no mark {mark}")
        text = re.sub(re.escape(mark) + r".*?<!-- end -->", lambda _: "\n".join([mark, *lines, "<!-- end -->"]), text, flags=re.S)
    with open(path, "w", encoding="utf-8") as f:
        f.write(text)


def series(rows, query, value, structure):
    """Half-angle by half-angle of round primary cones, rays at the left."""
    out = []
    for i, angle in enumerate(ANGLES):
        row = find(rows, structure=structure, query=query, kind="primary", half_angle_deg=angle, eccentricity="0")
        if row:
            out.append((i, float(row[value])))
    return out


class Plot:
    """A row of charts over the half-angle or another quantity, drawn by gnuplot."""

    def __init__(self, docs, name, charts):
        self.path = os.path.join(docs, f"performance-{name}.png")
        self.script = [f"set terminal pngcairo size {340 * charts + 60},330 font 'sans,10' background 'white'",
                       f"set output '{self.path}'", f"set multiplot layout 1,{charts}",
                       "set border 3 lc rgb '#606060'", "set tics nomirror out", "set grid ytics lc rgb '#d0d0d0' lw 0.6"]

    def chart(self, title, lines, log=True, key="top left", xtics=None, xlabel="half-angle of the cone", ylabel=None, colours=None):
        colours = colours or ["#d55e00", "#0072b2", "#008060", "#555555"]
        tics = xtics or ", ".join(f"'{LABEL[a].replace('⁻⁵', '^{-5}')}' {i}" for i, a in enumerate(ANGLES))
        self.script += [f"set key {key} Left reverse samplen 1.5", f"set title \"{title}\"", f"set xtics ({tics})", f"set xlabel '{xlabel}'",
                        f"set ylabel '{ylabel or ''}'", "set logscale y" if log else "unset logscale y"]
        if not log:
            self.script.append("set yrange [0:*]")
        else:
            self.script.append("set yrange [*:*]")
        width = max(x for _, points in lines for x, _ in points)
        self.script.append(f"set xrange [-0.3:{width + 0.3}]")
        for i, (_, points) in enumerate(lines):
            self.script += [f"$d{i} << EOD", *(f"{x} {y}" for x, y in points), "EOD"]
        self.script.append("plot " + ", ".join(
            f"$d{i} using 1:2 with linespoints lw 2 pt {5 + 2 * i} ps 0.8 lc rgb '{colours[i % 4]}' title '{name}'"
            for i, (name, _) in enumerate(lines)))

    def draw(self):
        subprocess.run(["gnuplot", "--default-settings", "-"], input="\n".join(self.script + ["unset multiplot", ""]), text=True,
                       check=True)


def draw(tables, docs):
    m = tables["munich"]
    costs = sorted((float(k[5:]), k) for k in tables if k.startswith("cost-"))
    p = Plot(docs, "cost", 3)
    for angle in ["1e-05", "0.5", "15"]:
        lines = []
        for structure in STRUCTURES:
            points = []
            for i, (_, key) in enumerate(costs):
                row = find(tables[key], structure=structure, query="nearest", kind="primary", half_angle_deg=angle, eccentricity="0")
                points.append((i, float(row["us_per_query"])))
            lines.append((structure, points))
        p.chart(LABEL[angle].replace("⁻⁵", "^{-5}"), lines, log=False, key="top right", xlabel="cost of a leaf over that of a node",
                ylabel="nearest, µs", xtics=", ".join(f"'{c:g}' {i}" for i, (c, _) in enumerate(costs)))
    p.draw()
    p = Plot(docs, "time", 2)
    for query in ["nearest", "all"]:
        p.chart(f"{query}: µs a primary cone", [(s, series(m, query, "us_per_query", s)) for s in STRUCTURES])
    p.draw()
    p = Plot(docs, "shadow", 3)
    for s in STRUCTURES:
        p.chart(f"{s}: µs", [(q, series(m, q, "us_per_query", s)) for q in ["all", "nearest", "any"]])
    p.draw()
    orders = ["slabs", "exact", "directrix", "midpoint"]
    p = Plot(docs, "order", 3)
    for value, title in [("us_per_query", "bvh, nearest: µs"), ("nodes", "nodes"), ("triangles", "triangles")]:
        p.chart(title, [(o, series(tables["order-" + o], "nearest", value, "bvh")) for o in orders])
    p.draw()
    p = Plot(docs, "contained", 2)
    for s in ["bvh", "bvh8"]:
        p.chart(f"{s}, all: µs", [(f"{'with' if y == 'yes' else 'without'} contained subtrees",
                                   series(tables["contained-" + y], "all", "us_per_query", s)) for y in ["yes", "no"]])
    p.draw()
    p = Plot(docs, "leaf", 2)
    for value, title in [("us_per_query", "bvh8, all: µs"), ("triangles", "triangles")]:
        p.chart(title, [(name, series(tables["leaf-" + y], "all", value, "bvh8"))
                        for y, name in [("yes", "boxes of leaves tested"), ("no", "not")]])
    p.draw()
    p = Plot(docs, "share", 1)
    lines = []
    for s in STRUCTURES:
        walk, whole = series(tables["walk"], "walk", "us_per_query", s), dict(series(m, "all", "us_per_query", s))
        lines.append((s, [(x, 100 * max(0, 1 - t / whole[x])) for x, t in walk if x > 0]))
    p.chart("in leaves, % of the time of all", lines, log=False, key="bottom right")
    p.draw()


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    results, docs = sys.argv[1:]
    tables = read(results)
    draw(tables, docs)
    fill(docs, {"targets": targets(tables), "builds": builds(tables), "growth": growth(tables), "rays": rays(tables),
                "table 1": paper(tables, "primary", "0"), "table 2": paper(tables, "random", "random"), **next_hits(results),
                **structures_table.structures(tables)})


if __name__ == "__main__":
    main()
