"""Runs `keller scene` as a user does: exit statuses, messages, what is left in the folder, and that what is written is read
back as it was. Speaks TAP."""
import hashlib
import os
import pathlib
import resource
import struct
import sys
import tempfile

sys.dont_write_bytecode = True
from test_program import BAD_INPUT, DONE, IO, USAGE, expect, keller, names

ITU = {"itu_concrete", "itu_brick", "itu_glass", "itu_medium_dry_ground"}
CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<simulation version="1" domain="rf">
  <scene file="city.obj"/>
  <frequency>3.5 GHz</frequency>
  <transmitter id="tx1"> <position x="0 m" y="0 m" z="120 m"/> </transmitter>
  <receiver id="rx1"> <position x="1 m" y="2 m" z="125 m"/> </receiver>
  <paths reflections="1" diffractions="0"/>
</simulation>
"""


def scene(*arguments, **more):
    return keller("scene", *arguments, **more)


def read_obj(path):
    """(vertices as written, triangles as (object, material, corners from 0))."""
    vertices, triangles, owner, material = [], [], None, None
    for line in path.read_text().splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            vertices.append(rest)
        elif word == "o":
            owner = rest
        elif word == "usemtl":
            material = rest
        elif word == "f":
            triangles.append((owner, material, tuple(int(corner) - 1 for corner in rest.split())))
    return vertices, triangles


def rows(text):
    """The rows `  name      value` of a table; a name that stands twice keeps its first value."""
    found = {}
    for line in text.splitlines():
        if line.startswith("  ") and len(line) > 21:
            found.setdefault(line[2:20].strip(), line[21:].strip())
    return found


# ---- generate -------------------------------------------------------------------------------------------------------


def test_a_city_is_made_as_told_and_the_same_again(folder, shared):
    done = expect(scene("generate", "city", "--seed", "7", "--blocks", "20", "-o", "city.obj", cwd=folder), DONE)
    told = rows(done.stdout)
    vertices, triangles = read_obj(folder / "city.obj")
    assert told["triangles"] == str(len(triangles)) and told["vertices"] == str(len(vertices)), told
    assert {material for _, material, _ in triangles} <= ITU
    owners = {owner for owner, _, _ in triangles}
    assert "ground" in owners and f"building_{len(owners) - 1}" in owners and told["objects"] == str(len(owners))
    expect(scene("generate", "-o", "again.obj", "--seed=7", "city", "--blocks=20", cwd=folder), DONE)
    assert (folder / "again.obj").read_bytes() == (folder / "city.obj").read_bytes()
    expect(scene("generate", "city", "--seed", "8", "--blocks", "20", "-o", "other.obj", cwd=folder), DONE)
    assert read_obj(folder / "other.obj")[0] != vertices
    star = ["--seed", "7", "--blocks", "20", "--layout", "star"]
    expect(scene("generate", "city", *star, "-o", "star.obj", cwd=folder), DONE)
    assert read_obj(folder / "star.obj")[0] != vertices
    # the recipe in the file makes the file again
    recipe = (folder / "star.obj").read_text().splitlines()[0].split()[3:]
    assert recipe[:2] == ["scene", "generate"], recipe
    expect(keller(*recipe, "-o", "star2.obj", cwd=folder), DONE)
    assert (folder / "star2.obj").read_bytes() == (folder / "star.obj").read_bytes()


def test_scenes_stay_what_they_were(folder, shared):
    """The same options make the same bytes on every machine; a change of these sums is a change of the scenes."""
    for arguments, expected in [
        (["city", "--blocks", "30"], "f09fee467152cebd"),
        (["city", "--blocks", "30", "--layout", "star"], "92f2706fd76a52f9"),
        (["random"], "89f2ab265e2e4a32"), (["slivers-sphere"], "df38fc62a83b84e6"),
        (["hair"], "626f7890e06638e7"), (["layers"], "3c6377eee0375c1b"),
    ]:
        expect(scene("generate", *arguments, "-o", "a.ply", "--force", cwd=folder), DONE)
        body = (folder / "a.ply").read_bytes().split(b"end_header\n", 1)[1]
        found = hashlib.sha256(body).hexdigest()[:16]
        assert found == expected, f"{arguments}: {found}"


def test_a_city_of_a_million_triangles(folder, shared):
    told = rows(expect(scene("generate", "city", "--triangles", "1000000", "-o", "city.ply", cwd=folder), DONE).stdout)
    assert abs(int(told["triangles"]) - 1000000) < 10000, told


def test_the_other_scenes_are_made(folder, shared):
    for arguments, triangles in [
        (["random", "--triangles", "500", "--size", "2"], 500), (["slivers-sphere", "--triangles", "1400"], 1400),
        (["hair", "--strands", "10"], 310), (["layers", "--count", "60"], 60 * 130),
        (["terrain", "--triangles", "200"], 200), (["terrain", "--triangles", "200", "--count", "2", "--seed", "4"], 200 + 2 * 14),
    ]:
        told = rows(expect(scene("generate", *arguments, "-o", "a.obj", "--force", cwd=folder), DONE).stdout)
        assert int(told["triangles"]) == triangles == len(read_obj(folder / "a.obj")[1]), told


def test_a_generated_city_can_be_simulated(folder, shared):
    expect(scene("generate", "city", "--blocks", "4", "-o", "city.obj", cwd=folder), DONE)
    (folder / "small.xml").write_text(CONFIG)
    assert "line of sight" in expect(keller("run", "small.xml", "-q", cwd=folder), DONE).stdout


# ---- convert --------------------------------------------------------------------------------------------------------


def test_obj_to_ply_to_obj_keeps_every_bit(folder, shared):
    for layout in ["grid", "star"]:
        expect(scene("generate", "city", "--blocks", "8", "--layout", layout, "-o", "a.obj", "--force", cwd=folder), DONE)
        told = expect(scene("convert", "a.obj", "-o", "b.ply", "--force", cwd=folder), DONE).stdout
        assert "names" in told and "lost" in told, told
        expect(scene("convert", "b.ply", "-o", "c.obj", "--force", cwd=folder), DONE)
        expect(scene("convert", "a.obj", "-o", "d.obj", "--force", cwd=folder), DONE)
        vertices, triangles = read_obj(folder / "a.obj")
        assert read_obj(folder / "d.obj") == (vertices, triangles)
        back, faces = read_obj(folder / "c.obj")
        assert back == vertices, "vertices changed"
        assert [corners for _, _, corners in faces] == [corners for _, _, corners in triangles]
        assert {(owner, material) for owner, material, _ in faces} == {("b", None)}


def test_ply_is_what_its_header_says(folder, shared):
    expect(scene("generate", "layers", "--count", "2", "-o", "a.ply", cwd=folder), DONE)
    head, body = (folder / "a.ply").read_bytes().split(b"end_header\n", 1)
    assert head.startswith(b"ply\nformat binary_little_endian 1.0\n") and b"element vertex 200\n" in head, head
    assert b"element face 260\n" in head and len(body) == 200 * 24 + 260 * 13
    assert all(struct.unpack_from("<BIII", body, 4800 + 13 * i)[0] == 3 for i in range(260))


def test_stl_is_single_precision_and_says_so(folder, shared):
    (folder / "a.obj").write_text("o left\nusemtl x\nv 0.1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    told = expect(scene("convert", "a.obj", "-o", "b.stl", cwd=folder), DONE).stdout
    assert "single precision" in told and "rounded" in told, told
    data = (folder / "b.stl").read_bytes()
    assert len(data) == 84 + 50 and not data.startswith(b"solid") and struct.unpack_from("<I", data, 80) == (1,)
    tenth = struct.unpack("<f", struct.pack("<f", 0.1))[0]
    assert struct.unpack_from("<12f", data, 84) == (0, 0, 1, tenth, 0, 0, 1, 0, 0, 0, 1, 0)


def test_an_existing_file_and_an_input_are_kept(folder, shared):
    expect(scene("generate", "layers", "-o", "a.obj", cwd=folder), DONE)
    (folder / "mine.ply").write_text("mine")
    expect(scene("convert", "a.obj", "-o", "mine.ply", cwd=folder), IO, "mine.ply", "--force")
    expect(scene("generate", "city", "-o", "mine.ply", cwd=folder), IO, "mine.ply", "--force")
    assert (folder / "mine.ply").read_text() == "mine"
    before = (folder / "a.obj").read_bytes()
    os.link(folder / "a.obj", folder / "same.ply")
    for output in ["a.obj", "same.ply"]:
        expect(scene("convert", "a.obj", "-o", output, "--force", cwd=folder), IO, output, "the scene to convert")
    assert (folder / "a.obj").read_bytes() == before
    expect(scene("convert", "a.obj", "-o", "mine.ply", "--force", cwd=folder), DONE)
    assert names(folder) == ["a.obj", "mine.ply", "same.ply"]


def test_nothing_is_left_when_writing_fails(folder, shared):
    bounded = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))}
    for name in ["a.obj", "a.ply", "a.stl"]:
        expect(scene("generate", "city", "-o", name, cwd=folder, **bounded), IO, name)
    expect(scene("generate", "city", "-o", "none/a.obj", cwd=folder), IO, "none/a.obj")
    (folder / "far.obj").write_text("v 1e39 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    expect(scene("convert", "far.obj", "-o", "far.stl", cwd=folder), BAD_INPUT, "far.stl", "vertex 0")
    assert names(folder) == ["far.obj"]


def test_bad_scenes_are_told_with_file_and_line(folder, shared):
    (folder / "bad.obj").write_text("v 0 0 0\nv 1 0 0\nf 1 2 3\n")
    expect(scene("convert", "bad.obj", "-o", "b.ply", cwd=folder), BAD_INPUT, "bad.obj:3")
    expect(scene("stats", "bad.obj", cwd=folder), BAD_INPUT, "bad.obj:3")
    expect(scene("convert", "none.obj", "-o", "b.ply", cwd=folder), IO, "none.obj")
    expect(scene("stats", "none.obj", cwd=folder), IO, "none.obj")
    assert names(folder) == ["bad.obj"]


# ---- stats ----------------------------------------------------------------------------------------------------------


def test_stats_of_a_city(folder, shared):
    expect(scene("generate", "city", "--blocks", "12", "-o", "city.obj", cwd=folder), DONE)
    vertices, triangles = read_obj(folder / "city.obj")
    told = rows(expect(scene("stats", "city.obj", cwd=folder), DONE).stdout)
    buildings = len({owner for owner, _, _ in triangles}) - 1
    edges = {}
    for _, _, c in triangles:
        for i in range(3):
            key = frozenset((c[i], c[(i + 1) % 3]))
            edges[key] = edges.get(key, 0) + 1
    for name, value in [
        ("triangles", len(triangles)), ("vertices", len(vertices)), ("welded vertices", 0), ("all", len(edges)),
        ("of 1 triangle", sum(n == 1 for n in edges.values())), ("of 2 triangles", sum(n == 2 for n in edges.values())),
        ("of 3 triangles", 0), ("closed objects", f"{buildings} of {buildings + 1}"),
    ]:
        assert told[name] == str(value), f"{name}: {told[name]}, not {value}"


def test_stats_of_a_mesh_in_need_of_repair(folder, shared):
    """Two triangles with a side of their own each, welded; one doubled; one without area; a third one at their edge."""
    (folder / "a.obj").write_text(
        "o one\nusemtl wall\nv 0 0 0\nv 4 0 0\nv 0 3 0\nf 1 2 3\no two\nv 4 0 0\nv 0 3 0\nv 4 3 0\nf 4 6 5\nf 4 6 5\n"
        "usemtl itu_wood\nf 4 4 5\nv 2 2 5\nf 2 3 7\n")
    done = expect(scene("stats", "a.obj", cwd=folder), DONE)
    told = rows(done.stdout)
    assert told["welded vertices"] == "2" and told["degenerate"].startswith("1 ") and told["duplicate"].startswith("1 ")
    assert (told["all"], told["of 1 triangle"], told["of 2 triangles"], told["of 3 triangles"]) == ("7", "6", "0", "1")
    assert told["closed objects"] == "0 of 2" and "notes" in done.stdout and "wall" in done.stdout
    lines = done.stdout.splitlines()
    assert "  size                4.000000      3.000000      5.000000" in lines, done.stdout


def test_stats_of_nothing(folder, shared):
    (folder / "a.obj").write_text("v 0 0 0\n")
    told = rows(expect(scene("stats", "a.obj", cwd=folder), DONE).stdout)
    assert told["triangles"] == "0" and told["all"] == "0"


# ---- usage ----------------------------------------------------------------------------------------------------------


def test_wrong_usage_is_told_in_one_line(folder, shared):
    for arguments, word in [
        ([], "generate"), (["fly"], "fly"), (["generate"], "city"), (["generate", "-o", "a.obj"], "city"),
        (["generate", "moon", "-o", "a.obj"], "moon"), (["generate", "city"], "-o"),
        (["generate", "city", "hair", "-o", "a.obj"], "hair"), (["generate", "city", "-o", "a.off"], "a.off"),
        (["generate", "city", "-o", "a"], ".obj"), (["generate", "city", "--blocks", "0", "-o", "a.obj"], "--blocks"),
        (["generate", "city", "--blocks", "x", "-o", "a.obj"], "--blocks"),
        (["generate", "city", "--seed", "-1", "-o", "a.obj"], "--seed"),
        (["generate", "city", "--blocks", "5", "--triangles", "5", "-o", "a.obj"], "exclude"),
        (["generate", "city", "--layout", "round", "-o", "a.obj"], "round"),
        (["generate", "city", "--size", "3", "-o", "a.obj"], "--size"),
        (["generate", "hair", "--blocks", "3", "-o", "a.obj"], "--blocks"),
        (["generate", "random", "--size", "0", "-o", "a.obj"], "--size"),
        (["generate", "random", "--size", "3 km", "-o", "a.obj"], "--size"),
        (["generate", "city", "--fast", "-o", "a.obj"], "--fast"), (["convert"], "scene"), (["convert", "a.obj"], "-o"),
        (["convert", "a.obj", "b.obj", "-o", "c.obj"], "b.obj"), (["convert", "a.obj", "-o", "c.xml"], "c.xml"),
        (["stats"], "scene"), (["stats", "a.obj", "b.obj"], "b.obj"), (["stats", "--force", "a.obj"], "--force"),
    ]:
        expect(scene(*arguments, cwd=folder), USAGE, word, "keller help")
    assert names(folder) == []
    text = expect(keller("help", "scene"), DONE).stdout
    assert "usage: keller scene" in text and expect(scene("generate", "--help"), DONE).stdout == text


def main():
    cases = [(name[5:].replace("_", " "), case) for name, case in globals().items() if name.startswith("test_")]
    chosen = [(name, case) for name, case in cases if all(word in name for word in sys.argv[1:])]
    print(f"1..{len(chosen)}", flush=True)
    failed = 0
    with tempfile.TemporaryDirectory() as shared:
        for number, (name, case) in enumerate(chosen, 1):
            try:
                with tempfile.TemporaryDirectory() as folder:
                    case(pathlib.Path(folder), pathlib.Path(shared))
                print(f"ok {number} - {name}", flush=True)
            except Exception as problem:  # a case that cannot go on has failed, whatever the reason
                failed += 1
                print(f"not ok {number} - {name}", flush=True)
                for line in f"{type(problem).__name__} at line {problem.__traceback__.tb_next.tb_lineno}: {problem}".splitlines():
                    print(f"# {line}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
