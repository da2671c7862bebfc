#!/usr/bin/env python3
"""The tables of docs/performance.md, "The next hit", from what `keller bench nexthit --csv` printed.

usage: keller bench nexthit --csv --scene munich.xml --scene classroom/scene.xml --layers 128 --peer embree | tools/nexthit_table.py
"""
import csv
import sys

ROWS = [("restart", "bvh8", "restart"), ("filter", "bvh8", "filter"), ("filter-n", "bvh8", "filter-n"), ("queue", "bvh8", "**queue**"),
        ("restart", "embree", "Embree, restart"), ("restart", "embree-robust", "Embree robust, restart"),
        ("filter", "embree", "Embree, filter"), ("filter", "embree-robust", "Embree robust, filter")]
LIMITS = ["1", "5", "15", "0"]


def line(*cells):
    print("| " + " | ".join(cells) + " |")


def head(left, *right):
    line(left, *right)
    line("---", *["---" if cell == "method" else "---:" for cell in right])


table = {(r["scene"], r["query"], r["method"], r["structure"], r["max_hits"]): r for r in csv.DictReader(sys.stdin)}
queries = list(dict.fromkeys(key[:2] for key in table))


def us(query, method, structure, limit):
    return float(table[query + (method, structure, limit)]["us_per_ray"])


head("scene, queries", "hits", "method", "1", "5", "15", "all")
for query in queries:
    first = [", ".join(query), f"{float(table[query + ('queue', 'bvh8', '0')]['hits_per_ray']):.3g}"]
    for method, structure, label in ROWS:
        if query + (method, structure, "0") in table:
            line(*first, label, *[f"{us(query, method, structure, limit):.3g}" for limit in LIMITS])
            first = ["", ""]
print()
head("scene, queries", "lost, fast mode", "repeated", "lost, robust mode", "repeated")
for query in queries:
    modes = [table[query + ("restart", peer, "0")] for peer in ("embree", "embree-robust") if query + ("restart", peer, "0") in table]
    if modes:
        line(", ".join(query), *[mode[column] for mode in modes for column in ("lost", "doubled")])
print()
head("scene, queries", "queue : restart, 1 hit", "queue : better of restart and filter, 5 hits", "15 hits", "queue : filter, all",
     "queue : Embree's filter, all")
for query in queries:
    ratios = [us(query, "restart", "bvh8", "1") / us(query, "queue", "bvh8", "1")]
    for limit in "5", "15":
        best = min(us(query, method, "bvh8", limit) for method in ("restart", "filter"))
        ratios.append(best / us(query, "queue", "bvh8", limit))
    ratios.append(us(query, "filter", "bvh8", "0") / us(query, "queue", "bvh8", "0"))
    if query + ("filter", "embree", "0") in table:
        ratios.append(us(query, "filter", "embree", "0") / us(query, "queue", "bvh8", "0"))
    line(", ".join(query), *[f"{ratio:.2f}" for ratio in ratios], *[""] * (5 - len(ratios)))
line("asked for", "0.9", "1.4 (deep scene)", "", "", "1.0")
ours = [row for row in table.values() if row["structure"].startswith("bvh")]
print("\nOurs lost", sum(int(row["lost"]) for row in ours), "and repeated", sum(int(row["doubled"]) for row in ours))
