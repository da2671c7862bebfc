"""The tables of masks and of batches in docs/performance.md, for tools/performance.py."""

MASKS = ["ideal", "table", "L1", "L2", "L3", "L4", "L5", "leaves", "compressed"]


def pick(rows, **wanted):
    return [row for row in rows if all(row[k] == v for k, v in wanted.items())]


def scenes_of(rows):
    return list(dict.fromkeys(row["scene"] for row in rows))


def percent(text):
    return f"{100 * float(text):.1f}"


def spared(rows):
    """Intersections with masks, in percent of those without: nearest hits of rays."""
    out = ["| scene, rays | cells | " + " | ".join(MASKS) + " |", "| --- | ---: |" + " ---: |" * len(MASKS)]
    for scene in scenes_of(rows):
        for kind in ["primary", "random"]:
            for R in ["4", "6"]:
                cells = [percent(pick(rows, scene=scene, kind=kind, R=R, masks=m, half_angle_deg="-1")[0]["ratio"]) for m in MASKS]
                out.append(f"| {scene}, {kind} | {R}³ | " + " | ".join(cells) + " |")
    return out


def cost(rows):
    """Time with the default's masks, and in brackets intersections, in percent of those without, by aperture; and building."""
    angles = [("-1", "ray"), ("1e-05", "10⁻⁵°"), ("0.1", "0.1°"), ("0.5", "0.5°"), ("5", "5°"), ("15", "15°")]
    out = ["| tree | scene, queries | " + " | ".join(name for _, name in angles) + " | ray, masks of all nodes (L3) | build, ms: with | without |",
           "| --- | --- |" + " ---: |" * (len(angles) + 3)]
    for tree, scene in dict.fromkeys((row["structure"], row["scene"]) for row in rows):
        mine = pick(rows, scene=scene, structure=tree)
        for kind in ["primary", "random"]:
            cells = []
            for angle, _ in angles:
                row = pick(mine, kind=kind, R="4", masks="leaves", half_angle_deg=angle)[0]
                cells.append(f"{100 * float(row['ratio_time']):.0f} ({100 * float(row['ratio']):.0f})")
            every = pick(mine, kind=kind, R="4", masks="L3", half_angle_deg="-1")[0]
            bare = pick(mine, kind=kind, masks="none")[0]
            cells += [f"{100 * float(every['ratio_time']):.0f}", f"{float(row['build_ms']):.0f}", f"{float(bare['build_ms']):.0f}"]
            out.append(f"| {tree} | {scene}, {kind} | " + " | ".join(cells) + " |")
    return out


def batches(rows):
    """Time of dacrt from nothing to the last answer over that of bvh8."""
    sizes = [10, 100, 1000, 10000, 100000, 1000000, 10000000]

    def size(row):  # the benchmark rounds to squares
        return min(sizes, key=lambda n: abs(int(row["queries"]) - n))

    out = ["| scene, queries | triangles | " + " | ".join(f"{n:,}" for n in sizes) + " |", "| --- | ---: |" + " ---: |" * len(sizes)]
    seen = dict.fromkeys((row["scene"], row["kind"], row["half_angle_deg"]) for row in rows)
    for scene, kind, angle in seen:
        mine = pick(rows, scene=scene, kind=kind, half_angle_deg=angle)
        by_size = {size(row): f"{float(row['ratio']):.2f}" for row in mine}
        what = "rays" if angle == "-1" else f"cones of {angle}°"
        out.append(f"| {scene}, {kind} {what} | {int(mine[0]['triangles']):,} | " + " | ".join(by_size.get(n, "") for n in sizes) + " |")
    return out


ANGLES = [("-1", "ray"), ("1e-05", "10⁻⁵°"), ("0.1", "0.1°"), ("0.5", "0.5°"), ("5", "5°"), ("15", "15°")]


def skewed(rows):
    """ubvh beside bvh8: tests, and time in percent of bvh8's."""
    out = ["| scene, queries | nodes, triangles a ray: bvh8 | ubvh | " + " | ".join(name for _, name in ANGLES)
           + " | build, ms: bvh8 | ubvh | bytes a triangle: bvh8 | ubvh |", "| --- | ---: | ---: |" + " ---: |" * (len(ANGLES) + 4)]
    for scene in scenes_of(rows):
        for kind in ["primary", "random"]:
            def row(structure, angle):
                query = "nearest" if angle == "-1" else "all"
                return pick(rows, scene=scene, kind=kind, structure=structure, half_angle_deg=angle, query=query, eccentricity="0")[0]
            plain, other = row("bvh8", "-1"), row("ubvh", "-1")
            cells = [f"{float(r['nodes']):.3g}, {float(r['triangles']):.3g}" for r in (plain, other)]
            for angle, _ in ANGLES:
                cells.append(f"{100 * float(row('ubvh', angle)['us_per_query']) / float(row('bvh8', angle)['us_per_query']):.0f}")
            for column in ["build_ms", "bytes_per_triangle"]:
                cells += [f"{float(r[column]):.0f}" for r in (plain, other)]
            out.append(f"| {scene}, {kind} | " + " | ".join(cells) + " |")
    return out


def skewed_kinds(rows):
    """The nearest hit of a ray by each kind of box, leaf and pair."""
    names = {"bvh8": "boxes along the axes (bvh8)", "dop14": "14-DOP", "obb": "oriented", "sobb": "skewed", "sobb-4": "skewed, 4-wide",
             "ubvh": "ubvh", "ubvh-skewed": "ubvh, all skewed", "ubvh-greedy": "ubvh, greedy pairs", "ubvh-ploc": "ubvh, PLOC pairs",
             "ubvh-4": "ubvh, all skewed, 4-wide"}
    out = ["| scene | boxes | build, ms | bytes a triangle | primary: nodes | triangles | time | random: nodes | triangles | time |",
           "| --- | --- |" + " ---: |" * 8]
    for scene in scenes_of(rows):
        for structure, name in names.items():
            cells = []
            for kind in ["primary", "random"]:
                row = pick(rows, scene=scene, kind=kind, structure=structure)[0]
                plain = pick(rows, scene=scene, kind=kind, structure="bvh8")[0]
                if not cells:
                    cells = [f"{float(row['build_ms']):.0f}", f"{float(row['bytes_per_triangle']):.0f}"]
                cells += [f"{float(row['nodes']):.3g}", f"{float(row['triangles']):.3g}",
                          f"{100 * float(row['us_per_query']) / float(plain['us_per_query']):.0f}"]
            out.append(f"| {scene if structure == 'bvh8' else ''} | {name} | " + " | ".join(cells) + " |")
    return out


def structures(tables):
    """All of them, by the names of their marks."""
    return {"masks spare": spared(tables["masks"]), "masks cost": cost(tables["masks"] + tables["masks-bvh"]),
            "batches": batches(tables["batch"]),
            "skewed": skewed(tables["ubvh"]), "skewed kinds": skewed_kinds(tables["ubvh-kinds"])}
