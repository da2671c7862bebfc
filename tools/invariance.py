"""Runs keller on one scene in ways that must not change which paths there are, and compares the paths found: other cones,
accelerators, numbers of threads, triangles in another order, transmitter and receivers exchanged.

Coordinates are in metres. SCENE is whatever the program reads; materials that an OBJ file names are ITU's, slabs of 10 cm.
--skip leaves out variations with NAME in their name. Paths are the same if they have the same interactions, by kind and by place to a
micrometre, and the same length to 1e-9 of it. A line for each variation says how many paths there are, how many of the first
run's are missing and how many there are more, by how much those found in both differ (places in m, lengths relative), how many
cones it took, and how long. The exit status is 1 if any is missing or more."""
import argparse
import pathlib
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter

import h5py
import numpy

SAME_PLACE = 1e-6   # m: beyond all rounding, and nothing else is that near
SAME_LENGTH = 1e-9
KINDS = "RDTS"      # as /interactions/kind counts them
CONES = ["8 deg", "2 deg", "0.5 deg"]       # half-angles: apertures of 16, 4 and 1 degrees
ACCELERATORS = ["bvh8", "bvh", "kdtree", "ubvh", "dacrt", "bvh8+mask", "bvh+mask"]

CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<simulation version="1" domain="rf">
  <scene file="{scene}"/>
  <frequency>3.5 GHz</frequency>
  {materials}
  {stations}
  <paths {orders} dynamic-range="4000 dB"/>
  <solver accelerator="{accelerator}" cone="{cone}"/>
  <output coverage="no" scene="no"/>
</simulation>
"""


def obj_materials(scene):
    """A <material> for each name in an OBJ file, which holds names alone; other formats bring their own."""
    if scene.suffix != ".obj":
        return ""
    lines = scene.read_text().splitlines()
    names = sorted({line.split(maxsplit=1)[1].strip() for line in lines if line.startswith("usemtl ")})
    thickness = {name: "" if name.endswith("ground") else ' thickness="10 cm"' for name in names}
    return "\n  ".join(f'<material name="{name}" itu="{name.removeprefix("itu_")}"{thickness[name]}/>' for name in names)


def position(point):
    x, y, z = point
    return f'<position x="{x!r} m" y="{y!r} m" z="{z!r} m"/>'


class Runs:
    """Runs of the program on one scene, with results kept in a folder."""

    def __init__(self, program, scene, transmitters, receivers, orders, folder):
        self.program, self.scene, self.folder = program, pathlib.Path(scene).resolve(), pathlib.Path(folder)
        self.transmitters, self.receivers, self.orders, self.cones = transmitters, receivers, orders, 0

    def run(self, *arguments):
        subprocess.run([self.program, *arguments], cwd=self.folder, check=True, stdout=subprocess.DEVNULL)

    def paths(self, accelerator="auto", cone="1 deg", threads=1, scene=None, exchanged=False):
        """{(transmitter, receiver): [(kinds, places, length)]}, of an exchanged run as the paths of the first run that they
        reverse. `self.cones` then says how many cones it took."""
        scene = scene or self.scene
        ends = [self.transmitters, self.receivers]
        if exchanged:
            ends.reverse()
        stations = [f'<{kind} id="{kind}{i}"> {position(point)} </{kind}>'
                    for kind, points in zip(["transmitter", "receiver"], ends) for i, point in enumerate(points)]
        orders = " ".join(f'{order}="{count}"' for order, count in self.orders.items())
        config = CONFIG.format(scene=scene, materials=obj_materials(scene), stations="\n  ".join(stations),
                               accelerator=accelerator, cone=cone, orders=orders)
        (self.folder / "run.xml").write_text(config)
        result = self.folder / "run.h5"
        self.run("run", "run.xml", "-q", "-j", str(threads), "-o", result, "--force")
        with h5py.File(result) as file:
            self.cones = int(file["statistics/cones_traced"][()])
        return read_paths(result, exchanged)

    def shuffled(self, seed):
        """The scene as OBJ, its triangles and vertices in another order, corners turned and flipped."""
        plain, mixed = self.folder / "plain.obj", self.folder / "mixed.obj"
        self.run("scene", "convert", self.scene, "-o", plain, "--force")
        shuffle_obj(plain, mixed, seed)
        return mixed


def shuffle_obj(source, target, seed):
    chance = random.Random(seed)
    vertices, faces, owner, material = [], [], [], []
    for line in source.read_text().splitlines():
        word = line.split(maxsplit=1)[0] if line.strip() else ""
        if word == "v":
            vertices.append(line)
        elif word == "o":
            owner = [line]
        elif word == "usemtl":
            material = [line]
        elif word == "f":
            faces.append((owner + material, [int(corner) - 1 for corner in line.split()[1:]]))
    order = list(range(len(vertices)))
    chance.shuffle(order)
    place = {old: new for new, old in enumerate(order)}
    chance.shuffle(faces)
    lines = [vertices[old] for old in order]
    for names, corners in faces:
        turn = chance.randrange(3)
        corners = corners[turn:] + corners[:turn]
        if chance.randrange(2):
            corners.reverse()
        lines += names + ["f " + " ".join(str(place[corner] + 1) for corner in corners)]
    target.write_text("\n".join(lines) + "\n")


def read_paths(result, exchanged=False):
    with h5py.File(result) as file:
        offset, length = file["paths/offset"][:], file["paths/length"][:]
        kind, place = file["interactions/kind"][:], file["interactions/position"][:]
        pairs = list(zip(file["paths/tx"][:].tolist(), file["paths/rx"][:].tolist()))
    found = {}
    for i, pair in enumerate(pairs):
        rows = slice(int(offset[i]), int(offset[i + 1]))
        kinds, places = "".join(KINDS[k] for k in kind[rows]), place[rows]
        if exchanged:
            pair, kinds, places = pair[::-1], kinds[::-1], places[::-1]
        found.setdefault(pair, []).append((kinds, places, float(length[i])))
    return found


def compare(base, other):
    """What `other` lacks and has more, as lists of (pair, path), and by how much the rest's places and lengths differ at most."""
    missing, extra, place, length = [], [], 0.0, 0.0
    for pair in sorted(base.keys() | other.keys()):
        left = {}
        for path in other.get(pair, []):
            left.setdefault(path[0], []).append(path)
        for path in base.get(pair, []):
            kinds, places, long = path
            candidates = left.get(kinds, [])
            for i, (_, other_places, other_long) in enumerate(candidates):
                apart = float(numpy.abs(places - other_places).max()) if kinds else 0.0
                if abs(other_long - long) <= SAME_LENGTH * long and apart <= SAME_PLACE:
                    place, length = max(place, apart), max(length, abs(other_long - long) / long)
                    del candidates[i]
                    break
            else:
                missing.append((pair, path))
        extra += [(pair, path) for paths in left.values() for path in paths]
    return missing, extra, place, length


def variations(runs, seed, skip):
    """(name, arguments of Runs.paths), the first run's being none; names that hold a word of `skip` left out."""
    for name, arguments in all_variations(runs, seed):
        if not any(word in name for word in skip):
            yield name, arguments


def all_variations(runs, seed):
    yield from ((f"half-angle {cone}", {"cone": cone}) for cone in CONES)
    yield from ((f"accelerator {name}", {"accelerator": name}) for name in ACCELERATORS)
    yield "2 threads", {"threads": 2}
    yield "triangles shuffled", {"scene": runs.shuffled(seed)}
    yield "ends exchanged", {"exchanged": True}


def hold(runs, tell, seed=1, skip=()):
    """Runs all variations, tells a line of each, and returns (the first run's paths, how many are missing or more)."""
    start = time.monotonic()
    base, wrong = runs.paths(), 0
    count, cones = sum(len(paths) for paths in base.values()), runs.cones
    kinds = Counter("".join(sorted(path[0], key=KINDS.index)) or "-" for paths in base.values() for path in paths)
    tell(f"{runs.scene.name}: {count} paths, {cones} cones, {time.monotonic() - start:.1f} s: " +
         ", ".join(f"{kind} {n}" for kind, n in sorted(kinds.items())))
    for name, arguments in variations(runs, seed, skip):
        start = time.monotonic()
        missing, extra, place, length = compare(base, runs.paths(**arguments))
        tell(f"{name:22} {count - len(missing) + len(extra):8} paths, {len(missing)} missing, {len(extra)} more; "
             f"places {place:.1e}, lengths {length:.1e}; {runs.cones} cones, {time.monotonic() - start:.1f} s")
        for what, paths in [("missing", missing), ("more", extra)]:
            for pair, (kinds, places, long) in paths[:10]:
                where = " ".join("(" + ", ".join(f"{x:.7f}" for x in place) + ")" for place in places)
                tell(f"  {what}: {pair} {kinds or '-'} {long:.10f} m {where}")
        wrong += len(missing) + len(extra)
    return base, wrong


def point(text):
    x, y, z = (float(number) for number in text.split(","))
    return x, y, z


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=lambda name: pathlib.Path(name).resolve())
    parser.add_argument("scene")
    parser.add_argument("--tx", type=point, required=True)
    parser.add_argument("--rx", type=point, action="append", required=True)
    for order, count in [("reflections", 2), ("diffractions", 1), ("transmissions", 0), ("interactions", 3)]:
        parser.add_argument(f"--{order}", type=int, default=count)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--skip", action="append", default=[])
    options = parser.parse_args()
    orders = {order: getattr(options, order) for order in ["reflections", "diffractions", "transmissions", "interactions"]}
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(options.program, options.scene, [options.tx], options.rx, orders, folder)
        _, wrong = hold(runs, lambda line: print(line, flush=True), options.seed, options.skip)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
