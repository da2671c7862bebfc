"""Runs the real program (KELLER_PROGRAM) as a user does: exit statuses, messages, what is left in the folder, and that the
files it writes are what the documentation says. Speaks TAP."""
import csv
import json
import math
import os
import pathlib
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree

PROGRAM = os.environ.get("KELLER_PROGRAM", "keller")
SOURCE = pathlib.Path(os.environ.get("KELLER_SOURCE", pathlib.Path(__file__).resolve().parents[2]))
DONE, FAILED, USAGE, BAD_INPUT, IO = range(5)

# A floor and one wall: line of sight, ground and wall reflections, and edges that diffract.
SCENE = """o floor
v -20 -20 0
v 20 -20 0
v 20 20 0
v -20 20 0
f 1 2 3 4
o wall
v -5 4 0
v 5 4 0
v 5 4 3
v -5 4 3
f 5 6 7 8
"""
CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<simulation version="1" domain="rf">
  <scene file="scene.obj"/>
  <frequency>3.5 GHz</frequency>
  <frequency>28 GHz</frequency>
  <material name="concrete" itu="concrete"/>
  <default-material name="concrete"/>
  <transmitter id="tx1"> <position x="-3 m" y="0 m" z="2 m"/> <power>30 dBm</power> </transmitter>
  <transmitter id="tx2"> <position x="3 m" y="1 m" z="2 m"/> </transmitter>
  <receiver id="rx1"> <position x="2 m" y="-1 m" z="1.5 m"/> </receiver>
  <receivers id="walk" file="walk.csv"/>
  <grid id="map" z="1.5 m"> <from x="-4 m" y="-2 m"/> <to x="4 m" y="2 m"/> <step>STEP</step> </grid>
  <paths reflections="2" diffractions="1" interactions="2"/>
</simulation>
"""
RECEIVERS, NY, NX = 1 + 3 + 15, 3, 5    # at a step of 2 m


ANGLES = ["departure_azimuth", "departure_zenith", "arrival_azimuth", "arrival_zenith"]


class Skip(Exception):
    pass


def keller(*arguments, cwd=None, **more):
    return subprocess.run([PROGRAM, *map(str, arguments)], cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, timeout=300, **more)


def expect(done, status, *words):
    """The exit status, and if it is not 0, one line on standard error with these words in it."""
    assert done.returncode == status, f"exit status {done.returncode}, not {status}: {done.stderr}"
    if status:
        lines = done.stderr.splitlines()
        assert len(lines) == 1 and lines[0].startswith("keller: "), f"not one line of error: {done.stderr!r}"
        for word in words:
            assert word in lines[0], f"{word!r} is not in {lines[0]!r}"
    return done


def write_inputs(folder, step="2 m"):
    (folder / "scene.obj").write_text(SCENE)
    (folder / "walk.csv").write_text("x,y,z\n0,-3,1.5\n1,-3,1.5\n2,-3,1.5\n")
    (folder / "small.xml").write_text(CONFIG.replace("STEP", step))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def finished(shared):
    """One result that all cases may read: made by the first that asks."""
    result = shared / "small.h5"
    if not result.exists():
        write_inputs(shared)
        expect(keller("run", "small.xml", "-q", cwd=shared), DONE)
    return result


# ---- usage ----------------------------------------------------------------------------------------------------------


def test_version_and_help(folder, shared):
    assert expect(keller("--version"), DONE).stdout.startswith("keller ")
    assert "usage: keller VERB" in expect(keller("help"), DONE).stdout
    assert "usage: keller VERB" in expect(keller("--help"), DONE).stdout
    for verb in ["run", "check", "info", "paths", "plot", "bench", "help", "version"]:
        text = expect(keller("help", verb), DONE).stdout
        assert f"usage: keller {verb}" in text
        assert expect(keller(verb, "--help"), DONE).stdout == text


def test_wrong_usage_is_told_in_one_line(folder, shared):
    for arguments, word in [
        ([], "verb"), (["fly"], "fly"), (["--fly"], "--fly"), (["help", "fly"], "fly"), (["run"], "configuration"),
        (["run", "a.xml", "b.xml"], "b.xml"), (["run", "--fast", "a.xml"], "--fast"), (["run", "-x", "a.xml"], "-x"),
        (["run", "a.xml", "-o"], "-o"), (["run", "a.xml", "--force=yes"], "--force"), (["run", "a.xml", "-j", "two"], "two"),
        (["run", "a.xml", "-j", "-1"], "-1"), (["run", "a.xml", "-D", "NAME"], "NAME=VALUE"),
        (["run", "a.xml", "-D", "1=2"], "NAME=VALUE"), (["run", "a.xml", "--resume"], "does not resume"),
        (["run", "a.xml", "-q", "-v"], "exclude"), (["check"], "configuration"), (["check", "--force", "a.xml"], "--force"),
        (["info"], "file"), (["info", "a", "b"], "b"), (["paths"], "result"), (["paths", "a.h5", "--format", "pdf"], "pdf"),
        (["paths", "a.h5", "--strongest", "0"], "--strongest"), (["plot", "a.h5"], "-o"),
        (["plot", "a.h5", "--what", "delay", "--frequency", "1", "-o", "a.png"], "first frequency"),
        (["plot", "a.h5", "--what", "delay-spread", "--sum", "coherent", "-o", "a.png"], "--sum"),
        (["plot", "a.h5", "--sum", "both", "-o", "a.png"], "both"), (["export", "a.h5", "--sum", "coherent", "-o", "a.csv"], "--sum"),
        (["plot", "a.h5", "-o", "a.pdf"], "a.pdf"), (["plot", "a.h5", "--what", "noise", "-o", "a.png"], "noise"),
        (["export", "a.h5"], "ends in .csv"), (["scene"], "generate"),
        (["bench"], "cone"), (["bench", "nothing"], "cone"),
    ]:
        expect(keller(*arguments, cwd=folder), USAGE, word, "keller help")
    assert names(folder) == []


def test_missing_files_are_named(folder, shared):
    for verb in [["run"], ["check"], ["info"], ["paths"], ["plot", "-o", "a.png"]]:
        expect(keller(*verb, "none.h5", cwd=folder), IO, "none.h5")
    assert names(folder) == []


# ---- run --------------------------------------------------------------------------------------------------------------


def test_run_writes_the_result_under_the_default_name(folder, shared):
    write_inputs(folder)
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    done = expect(keller("run", "../small.xml", cwd=elsewhere), DONE)
    assert names(elsewhere) == ["small.h5"]
    for word in ["scene", "paths", "line of sight", "strongest path", "time/s"]:
        assert word in done.stdout, word
    assert done.stderr == ""


def test_run_quiet_says_nothing_on_standard_error_and_verbose_something(folder, shared):
    write_inputs(folder)
    assert keller("run", "small.xml", "-q", "-j1", cwd=folder).stderr == ""
    assert "simulating" in keller("run", "small.xml", "-v", "--force", cwd=folder).stderr


def test_an_existing_result_is_kept_unless_forced(folder, shared):
    write_inputs(folder)
    (folder / "small.h5").write_text("mine")
    expect(keller("run", "small.xml", cwd=folder), IO, "small.h5", "--force")
    assert (folder / "small.h5").read_text() == "mine"
    expect(keller("run", "small.xml", "--force", cwd=folder), DONE)
    assert (folder / "small.h5").read_bytes()[1:4] == b"HDF"
    assert names(folder) == ["scene.obj", "small.h5", "small.xml", "walk.csv"]


def test_an_input_is_never_replaced(folder, shared):
    write_inputs(folder)
    (folder / "linked.h5").symlink_to("scene.obj")
    os.link(folder / "walk.csv", folder / "hard.h5")
    contents = {path: path.read_bytes() for path in folder.iterdir()}
    for output, role in [("small.xml", "the configuration"), ("scene.obj", "the scene file"), ("walk.csv", "a route file"),
                         ("linked.h5", "the scene file"), ("hard.h5", "a route file"), ("./../" + folder.name + "/small.xml",
                                                                                       "the configuration")]:
        for force in [[], ["--force"]]:
            expect(keller("run", "small.xml", "-o", output, *force, cwd=folder), IO, output, role, "another")
    assert {path: path.read_bytes() for path in folder.iterdir()} == contents
    result = folder / "result.png"
    shutil.copy(finished(shared), result)
    before = result.read_bytes()
    expect(keller("plot", "result.png", "-o", "result.png", "--force", cwd=folder), IO, "result.png", "the result")
    assert result.read_bytes() == before


def test_places_that_cannot_be_written(folder, shared):
    write_inputs(folder)
    before = names(folder)
    (folder / "closed").mkdir()
    (folder / "closed").chmod(0o500)
    targets = ["none/out.h5", "scene.obj/out.h5", "closed", "/proc/out.h5"]
    if os.geteuid() != 0:
        targets.append("closed/out.h5")
    for target in targets:
        expect(keller("run", "small.xml", "-o", target, cwd=folder), IO, target)
    expect(keller("run", "small.xml", "--force", "-o", "/dev/full", cwd=folder), IO, "/dev/full", "regular file")
    (folder / "closed").rmdir()
    assert names(folder) == before


def test_a_full_disk_leaves_nothing_behind(folder, shared):
    """The limit on the size of files stands for the disk; the program reports the system's reason."""
    write_inputs(folder)
    before = names(folder)
    for limit in [0, 1000, 10000, 30000]:
        done = keller("run", "small.xml", cwd=folder,
                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        expect(done, IO, "small.h5", "File too large")
        assert names(folder) == before


def test_standard_output_that_cannot_be_written(folder, shared):
    result = finished(shared)
    for arguments in [["--version"], ["info", result], ["paths", result]]:
        with open("/dev/full", "w") as full:
            done = subprocess.run([PROGRAM, *map(str, arguments)], stdout=full, stderr=subprocess.PIPE, text=True)
        expect(done, IO, "standard output")


def test_interrupting_deletes_the_temporary_file(folder, shared):
    write_inputs(folder, step="5 mm")    # more than a million receivers: not done in a second
    before = names(folder)
    for number in [signal.SIGINT, signal.SIGTERM]:
        run = subprocess.Popen([PROGRAM, "run", "small.xml", "-q"], cwd=folder, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 120
        while names(folder) == before and run.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
        assert any(name.endswith(".part") for name in names(folder)), "no temporary file appeared"
        asked = time.monotonic()
        run.send_signal(number)
        _, error = run.communicate(timeout=60)
        assert time.monotonic() - asked < 5, "did not stop at once"
        assert run.returncode == FAILED, run.returncode
        assert "interrupted" in error and error.count("\n") == 1, error
        assert names(folder) == before, names(folder)


def test_variables_are_put_in_and_missed(folder, shared):
    write_inputs(folder)
    text = (folder / "small.xml").read_text().replace('"scene.obj"', '"$NAME.obj"')
    (folder / "small.xml").write_text(text)
    expect(keller("check", "small.xml", cwd=folder), BAD_INPUT, "NAME", "small.xml:3")
    expect(keller("check", "small.xml", "-D", "NAME=scene", cwd=folder), DONE)
    expect(keller("info", "small.xml", "-DNAME=scene", cwd=folder), DONE)


def test_bad_configuration_names_file_and_line(folder, shared):
    write_inputs(folder)
    (folder / "small.xml").write_text(CONFIG.replace("STEP", "2"))
    for verb in ["run", "check", "info"]:
        expect(keller(verb, "small.xml", cwd=folder), BAD_INPUT, "small.xml:12")
    assert "small.h5" not in names(folder)


def test_what_this_version_does_not_compute_is_refused(folder, shared):
    write_inputs(folder)
    text = (folder / "small.xml").read_text()
    paths = next(i for i, line in enumerate(text.splitlines(), 1) if "<paths" in line)
    for old, new, line, word in [
        ('itu="concrete"', 'itu="wet_ground"', 4, "wet_ground"),        # 1 to 10 GHz: the second frequency is outside
    ]:
        (folder / "small.xml").write_text(text.replace(old, new))
        if new == 'itu="wet_ground"':
            line = 5                                                     # the line of 28 GHz
        for verb in ["check", "run"]:
            expect(keller(verb, "small.xml", cwd=folder), BAD_INPUT, f"small.xml:{line}: ", word)
    assert names(folder) == ["scene.obj", "small.xml", "walk.csv"]


def test_broken_scenes_name_file_and_line(folder, shared):
    write_inputs(folder)
    text = (folder / "small.xml").read_text()
    for verb in ["run", "check"]:
        (folder / "small.xml").write_text(text.replace("scene.obj", "none.obj"))
        expect(keller(verb, "small.xml", cwd=folder), IO, "keller: small.xml:3: ", "none.obj")
        (folder / "small.xml").write_text(text.replace("walk.csv", "none.csv"))
        expect(keller(verb, "small.xml", cwd=folder), IO, "keller: small.xml:11: ", "none.csv")
    (folder / "small.xml").write_text(text)
    (folder / "scene.obj").write_text("v 0 0 0\nv 1e200 0 0\nv 0 1 0\nf 1 2 3\n")
    for arguments in [["run", "small.xml"], ["check", "small.xml"], ["info", "scene.obj"]]:
        expect(keller(*arguments, cwd=folder), BAD_INPUT, "keller: scene.obj: vertex 1 ", "1e+200")
    for text, words in [
        ("v 0 0\nf 1 1 1\n", ["scene.obj:1: "]), ("v 0 0 nan\n", ["scene.obj:1: "]), ("v 0 0 1e999\n", ["scene.obj:1: "]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", ["scene.obj:4: "]), ("v 0 0 0\nf 1 -2 1\n", ["scene.obj:2: "]),
    ]:
        (folder / "scene.obj").write_text(text)
        expect(keller("run", "small.xml", cwd=folder), BAD_INPUT, *words)
    assert names(folder) == ["scene.obj", "small.xml", "walk.csv"]


def test_an_empty_scene_is_free_space(folder, shared):
    write_inputs(folder)
    (folder / "scene.obj").write_text("# nothing\n")
    expect(keller("run", "small.xml", cwd=folder), DONE)
    rows = json.loads(expect(keller("paths", "small.h5", "--format", "json", cwd=folder), DONE).stdout)
    rows = rows["paths"] if isinstance(rows, dict) else rows
    assert len(rows) == 2 * RECEIVERS, len(rows)     # line of sight only, from both transmitters to all
    note = "note: the scene has no triangles: free space only"
    vertices_only = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    for text in ["# nothing\n", vertices_only]:
        (folder / "scene.obj").write_text(text)
        for arguments in [["run", "small.xml", "--force"], ["check", "small.xml"], ["info", "scene.obj"]]:
            done = expect(keller(*arguments, cwd=folder), DONE)
            assert note in done.stdout and done.stderr == "", (text, arguments, done.stdout, done.stderr)
    (folder / "scene.obj").write_text(vertices_only + "f 1 2 3\n")
    assert note not in expect(keller("check", "small.xml", cwd=folder), DONE).stdout


def test_objects_are_listed(folder, shared):
    write_inputs(folder)
    text = expect(keller("check", "small.xml", cwd=folder), DONE).stdout
    assert "2: floor, wall\n" in text, text
    (folder / "scene.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"o part{i}\nf 1 2 3\n" for i in range(23)))
    text = expect(keller("info", "scene.obj", cwd=folder), DONE).stdout
    # 23 objects: part0 to part19, and 3 that are not named
    listed = "23: " + ", ".join(f"part{i}" for i in range(20)) + " and 3 more box"
    assert listed in " ".join(text.split()) and max(map(len, text.splitlines())) <= 130, text


def test_cut_points_are_counted(folder, shared):
    write_inputs(folder)
    assert "cut points added   0\n" in expect(keller("info", "scene.obj", cwd=folder), DONE).stdout
    # A floor with a rim along x, and a screen in the plane y = 0 whose two sides, from (2, -2) and (8, -2) to (5, 3) in x
    # and z, cross the rim at x = 2 + 3*2/5 = 3.2 and 8 - 3*2/5 = 6.8. Between these the rim is a corner of floor and
    # screen, outside of them it is a rim: cut at two points that no file gave.
    (folder / "cross.obj").write_text("v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nf 1 2 3 4\n"
                                      "v 2 0 -2\nv 8 0 -2\nv 5 0 3\nf 5 6 7\n")
    text = expect(keller("info", "cross.obj", cwd=folder), DONE).stdout
    assert "cut points added   2\n" in text and "3 triangles, 9 vertices, 2 faces" in text, text


def test_check_says_what_would_run_and_writes_nothing(folder, shared):
    write_inputs(folder)
    before = names(folder)
    done = expect(keller("check", "small.xml", cwd=folder), DONE)
    for word in ["wavelength", "85.655 mm", "nothing was simulated", f"to {RECEIVERS} receivers"]:
        # c/f = 299792458/3.5e9 m = 85.65499 mm
        assert word in done.stdout, word
    assert names(folder) == before


# ---- the result ---------------------------------------------------------------------------------------------------------


def test_h5py_reads_every_dataset(folder, shared):
    """SPEC's table of the result file: type, shape and unit of each dataset."""
    try:
        import h5py
        import numpy
    except ImportError:
        raise Skip("this Python has no h5py")
    with h5py.File(finished(shared), "r") as f:
        assert f.attrs["format"] == "keller" and f.attrs["domain"] == "rf" and f.attrs["format_version"] == 1
        assert len(f.attrs["config_sha256"]) == 64 and f.attrs["command_line"].startswith("keller run small.xml")
        assert f.attrs["program_version"] and len(f.attrs["created"]) == len("2000-01-01T00:00:00Z")
        assert f["config"][()].decode().startswith("<?xml")
        P, I = len(f["paths/tx"]), len(f["interactions/kind"])
        V, N, W = (len(f[name]) for name in ["scene/vertices", "scene/triangles", "scene/wedges/n"])
        M, O = len(f["materials/name"]), len(f["scene/objects"])
        T, R, F, S = 2, RECEIVERS, 2, 3
        K = T * 4    # pairs whose receiver is not of a grid
        assert P > T * R and I > 0 and N == 4 and V == 8 and M == 1 and O == 2
        expected = {
            "frequencies": ("f8", (F,), "Hz"),
            "transmitters/id": (str, (T,), None), "transmitters/position": ("f8", (T, 3), "m"),
            "transmitters/orientation": ("f8", (T, 3), "rad"), "transmitters/velocity": ("f8", (T, 3), "m/s"),
            "transmitters/power": ("f8", (T,), "W"),
            "receivers/id": (str, (R,), None), "receivers/position": ("f8", (R, 3), "m"),
            "receivers/orientation": ("f8", (R, 3), "rad"), "receivers/velocity": ("f8", (R, 3), "m/s"),
            "receivers/set": ("u4", (R,), None), "receivers/index": ("u4", (R,), None),
            "sets/id": (str, (S,), None), "sets/kind": (["point", "route", "grid"], (S,), None),
            "sets/shape": ("u4", (S, 2), None),
            "materials/name": (str, (M,), None), "materials/permittivity": ("f8", (M, F), "1"),
            "materials/conductivity": ("f8", (M, F), "S/m"), "materials/thickness": ("f8", (M,), "m"),
            "materials/conductor": ("?", (M,), None), "materials/scattering": ("f8", (M,), "1"),
            "scene/vertices": ("f8", (V, 3), "m"), "scene/triangles": ("u4", (N, 3), None),
            "scene/face": ("u4", (N,), None), "scene/material": ("u2", (N,), None), "scene/object": ("u2", (N,), None),
            "scene/source": ("u4", (N,), None), "scene/objects": (str, (O,), None),
            "scene/wedges/vertices": ("u4", (W, 2), None), "scene/wedges/faces": ("u4", (W, 2), None),
            "scene/wedges/n": ("f8", (W,), "1"),
            "paths/tx": ("u4", (P,), None), "paths/rx": ("u4", (P,), None), "paths/offset": ("u8", (P + 1,), None),
            "paths/length": ("f8", (P,), "m"), "paths/delay": ("f8", (P,), "s"),
            "paths/departure": ("f8", (P, 2), "rad"), "paths/arrival": ("f8", (P, 2), "rad"),
            "paths/doppler": ("f8", (P, F), "Hz"), "paths/gain": ("c16", (P, F), "1"),
            "paths/transfer": ("c16", (P, F, 2, 2), "1"),
            "interactions/kind": (["reflection", "diffraction", "transmission", "scattering"], (I,), None),
            "interactions/position": ("f8", (I, 3), "m"), "interactions/triangle": ("u4", (I,), None),
            "interactions/wedge": ("u4", (I,), None), "interactions/free_end": ("u1", (I,), None),
            "paths/weight": ("f8", (P,), "1"), "paths/patch": ("f8", (P,), "m2"), "paths/part": ("f8", (P, 2), "m"),
            "geometry/scene_sha256": (str, (), None), "geometry/face_traits": ("u1", (2,), None),
            "geometry/reflections": ("u4", (), None), "geometry/holds_paths": ("u4", (), None), "geometry/patch": ("f8", (), "m"),
            "geometry/dynamic_range": ("f8", (), "dB"),
            "pairs/tx": ("u4", (K,), None), "pairs/rx": ("u4", (K,), None), "pairs/paths": ("u4", (K,), None),
            "pairs/path_gain": ("f8", (K, F), "1"), "pairs/path_gain_incoherent": ("f8", (K, F), "1"),
            "pairs/delay_spread": ("f8", (K,), "s"), "pairs/strongest_delay": ("f8", (K,), "s"),
            **{f"pairs/{angle}_spread": ("f8", (K,), "rad") for angle in ANGLES},
            **{f"coverage/map/{angle}_spread": ("f8", (T, NY, NX), "rad") for angle in ANGLES},
            "coverage/map/path_gain_incoherent": ("f8", (T, F, NY, NX), "1"),
            "coverage/map/path_gain": ("f8", (T, F, NY, NX), "1"), "coverage/map/delay_spread": ("f8", (T, NY, NX), "s"),
            "coverage/map/strongest_delay": ("f8", (T, NY, NX), "s"), "coverage/map/x": ("f8", (NX,), "m"),
            "coverage/map/y": ("f8", (NY,), "m"), "coverage/map/z": ("f8", (NY, NX), "m"),
        }
        for name, (kind, shape, unit) in expected.items():
            data = f[name]
            assert data.shape == shape, (name, data.shape, shape)
            assert data.attrs.get("units") == unit, (name, data.attrs.get("units"))
            if kind is str:
                assert h5py.check_string_dtype(data.dtype) == ("utf-8", None), name
            elif isinstance(kind, list):
                assert data.dtype == "u1" and h5py.check_enum_dtype(data.dtype) == dict(zip(kind, range(9))), name
            else:
                assert data.dtype == kind, (name, data.dtype)
            if name.startswith(("paths/", "interactions/")):
                assert data.chunks and data.compression == "gzip", name
            data[()]
        for name in ["time_configuration", "time_read", "time_scene", "time_accelerator", "time_simulation", "time_total"]:
            assert f["statistics"][name].shape == () and f["statistics"][name].attrs["units"] == "s", name
        for name in ["cones_traced", "nodes_visited", "triangles_visited", "candidates", "valid_paths", "threads", "boundary_paths",
                     "cornered_paths", "crowded_paths", "edges_as_one", "complete_scattering", "complete_with_scattering"]:
            assert f["statistics"][name].attrs["units"] == "1", name
        orders = {"reflections": 0, "diffractions": 0, "transmissions": 0, "interactions": 0}
        for name in orders:
            orders[name] = int(f["statistics/complete_" + name][()])
        assert orders["reflections"] >= 1 and orders["interactions"] >= orders["reflections"], orders
        assert f["statistics/dropped_bound"].attrs["units"] == "dB"
        weak = f["statistics/dropped_paths"][()]
        assert (weak > 0) == (f["statistics/dropped_bound"][()] > -1e308), weak
        assert f["statistics/peak_memory"].attrs["units"] == "B" and f["statistics/peak_memory"][()] > 1e6
        assert f["statistics/accelerator"][()].decode()
        # what the numbers mean: 30 dBm is 1 W; rx1 is 5.123 m from tx1 on the line of sight
        assert list(f["receivers/id"].asstr()) == ["rx1"] + [f"walk[{i}]" for i in range(3)] + [f"map[{i}]" for i in range(15)]
        assert f["transmitters/power"][0] == 1 and list(f["coverage/map/x"]) == [-4, -2, 0, 2, 4]
        assert (f["coverage/map/z"][()] == 1.5).all()
        first = (f["paths/tx"][()] == 0) & (f["paths/rx"][()] == 0)
        length = numpy.sqrt(5 ** 2 + 1 ** 2 + 0.5 ** 2)
        assert abs(f["paths/length"][first].min() - length) < 1e-12 * length
        assert abs(f["paths/delay"][first].min() - length / 299792458) < 1e-12 * length / 299792458
        offset = f["paths/offset"][()]
        assert offset[0] == 0 and offset[-1] == I and (numpy.diff(offset.astype("i8")) >= 0).all()
        kind, triangle, wedge = (f["interactions"][name][()] for name in ["kind", "triangle", "wedge"])
        assert ((kind == 1) == (triangle == 0xffffffff)).all() and ((kind == 1) == (wedge != 0xffffffff)).all()
        sums_are_those_of_the_paths(f, numpy)


def sums_are_those_of_the_paths(f, numpy):
    """The sums of every pair, and of every cell of the map, from its paths as docs/format.md says."""
    tx, rx, gain, delay = (f["paths/" + name][()] for name in ["tx", "rx", "gain", "delay"])
    angle = dict(zip(ANGLES, [f["paths/departure"][:, 1], f["paths/departure"][:, 0], f["paths/arrival"][:, 1], f["paths/arrival"][:, 0]]))
    row = 0
    for t in range(2):
        for r in range(RECEIVERS):
            mine = (tx == t) & (rx == r)
            power = abs(gain[mine]) ** 2
            weight = power[:, 0] / power[:, 0].sum()
            mean = (weight * delay[mine]).sum()
            expected = {"path_gain": abs(gain[mine].sum(axis=0)) ** 2, "path_gain_incoherent": power.sum(axis=0),
                        "delay_spread": numpy.sqrt((weight * (delay[mine] - mean) ** 2).sum()),
                        "strongest_delay": delay[mine][power[:, 0].argmax()]}
            for name in ANGLES:
                resultant = abs((weight * numpy.exp(1j * angle[name][mine])).sum())
                expected[name + "_spread"] = numpy.sqrt(-2 * numpy.log(resultant))
            if r < 4:
                assert (f["pairs/tx"][row], f["pairs/rx"][row], f["pairs/paths"][row]) == (t, r, mine.sum())
                found = {name: f["pairs/" + name][row] for name in expected}
                row += 1
            else:
                found = {name: f["coverage/map/" + name][t][..., (r - 4) // NX, (r - 4) % NX] for name in expected}
            for name, value in expected.items():
                assert numpy.allclose(found[name], value, rtol=1e-9, atol=1e-18 if "delay" in name else 0), (t, r, name)


def test_the_example_script_reads_the_result(folder, shared):
    script = SOURCE / "examples" / "read_paths.py"
    result = finished(shared)
    try:
        import h5py  # noqa: F401
    except ImportError:
        raise Skip("this Python has no h5py")
    done = subprocess.run([sys.executable, script, result], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0, done.stderr
    assert "tx1" in done.stdout and "rx1" in done.stdout


def test_waves_pass_through_walls(folder, shared):
    """Transmitter and receiver on two sides of two walls: with two transmissions the way through, with one there is none."""
    write_inputs(folder)
    text = (folder / "small.xml").read_text().replace('itu="concrete"/>', 'itu="concrete" thickness="10 cm"/>')
    text = text.replace('<position x="2 m" y="-1 m" z="1.5 m"/>', '<position x="-2 m" y="8 m" z="1 m"/>')
    (folder / "scene.obj").write_text(SCENE + "o second\nv -5 5 0\nv 5 5 0\nv 5 5 3\nv -5 5 3\nf 9 10 11 12\n")
    paths = next(i for i, line in enumerate(text.splitlines(), 1) if "<paths" in line)
    straight = {}
    for many in range(3):
        (folder / "small.xml").write_text(text.replace('diffractions="1"', f'diffractions="1" transmissions="{many}"'))
        words = f"2 reflections, 1 diffractions, {many} transmissions, at most 2 together"
        assert words in expect(keller("check", "small.xml", cwd=folder), DONE).stdout
        expect(keller("run", "small.xml", "--force", "-q", cwd=folder), DONE)
        rows = json.loads(expect(keller("paths", "small.h5", "--tx", "tx1", "--rx", "rx1", "--format", "json",
                                        cwd=folder), DONE).stdout)["paths"]
        straight[many] = [row for row in rows if set(row["sequence"]) <= set("T0123456789 ")]
        assert any("T" in row["sequence"] for row in rows) == (many > 0)
    assert not straight[0] and not straight[1] and len(straight[2]) == 1, straight
    length = math.sqrt(1 + 64 + 1)                    # from (-3, 0, 2) to (-2, 8, 1)
    assert abs(straight[2][0]["length_m"] - length) < 1e-12
    assert abs(straight[2][0]["delay_s"] - length / 299792458) < 1e-20
    assert straight[2][0]["gain_dB"][0] < 20 * math.log10(0.0856549880 / (4 * math.pi * length)) - 1   # two walls
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    with h5py.File(folder / "small.h5", "r") as f:
        kind, triangle, wedge = (f["interactions/" + name][()] for name in ["kind", "triangle", "wedge"])
        through = kind == 2
        assert through.any() and (wedge[through] == 0xFFFFFFFF).all()
        assert (triangle[through] < len(f["scene/triangles"])).all()
        position = f["interactions/position"][()][through]
        corners = f["scene/vertices"][()][f["scene/triangles"][()][triangle[through]]]
        for p, (a, b, c) in zip(position, corners):  # in the plane of the triangle, and in it
            n = [(b - a)[i - 2] * (c - a)[i - 1] - (b - a)[i - 1] * (c - a)[i - 2] for i in range(3)]
            assert abs(sum(n * (p - a))) < 1e-9 and (p > corners.min((0, 1)) - 1e-9).all()
        count = [kind[i:j].tolist().count(2) for i, j in zip(f["paths/offset"][:-1], f["paths/offset"][1:])]
        assert max(count) == 2
    note = "note: no wall lets anything through"
    for thickness, told in [('thickness="10 cm"', False), ("", True)]:
        (folder / "small.xml").write_text(text.replace('thickness="10 cm"', thickness).replace(
            'diffractions="1"', 'transmissions="1"'))
        for arguments in [["check", "small.xml"], ["run", "small.xml", "--force", "-q"]]:
            assert (note in expect(keller(*arguments, cwd=folder), DONE).stdout) == told, (thickness, arguments)
    for old, new, words in [
        ('diffractions="1"', 'transmissions="65"', ["transmissions", '"65"', "from 0 to 64"]),
        ('diffractions="1"', 'transmissions="-1"', ["transmissions", '"-1"']),
        ('diffractions="1"', 'transmissions="two"', ["transmissions", '"two"']),
        ('diffractions="1" interactions="2"', 'transmissions="63"', ["add up to 65 interactions", "at most 64"]),
    ]:
        (folder / "small.xml").write_text(text.replace(old, new))
        for verb in ["check", "run"]:
            expect(keller(verb, "small.xml", "--force", cwd=folder) if verb == "run" else keller(verb, "small.xml", cwd=folder),
                   BAD_INPUT, f"small.xml:{paths}: ", *words)


def test_walls_scatter_when_asked(folder, shared):
    """A floor of 40 m by 40 m has 64 patches of 5 m, a wall of 10 m by 3 m two: a path by each that both ends see over the wall."""
    write_inputs(folder)
    plain = (folder / "small.xml").read_text()
    rough = plain.replace('itu="concrete"/>', 'itu="concrete" scattering="0.6"/>')
    asked = rough.replace('interactions="2"', 'interactions="2" scattering="1" patch="5 m"')
    rows = {}
    for name, text in [("plain", plain), ("rough", rough), ("asked", asked)]:
        (folder / "small.xml").write_text(text)
        expect(keller("run", "small.xml", "--force", "-q", cwd=folder), DONE)
        rows[name] = json.loads(expect(keller("paths", "small.h5", "--tx", "tx1", "--rx", "rx1", "--format", "json",
                                              cwd=folder), DONE).stdout)["paths"]
    scattered = [row for row in rows["asked"] if row["sequence"].startswith("S")]
    others = [row for row in rows["asked"] if not row["sequence"].startswith("S")]
    assert others == rows["rough"] and len(rows["plain"]) == len(rows["rough"])

    def seen(end, x, y):
        """From (x, y, 0), past the wall, y = 4, -5 to 5 in x and 3 m high."""
        part = (y - 4) / (y - end[1])
        return y < 4 or abs(x + part * (end[0] - x)) > 5 or part * end[2] > 3

    middles = [(x / 2, y / 2) for x in range(-35, 40, 10) for y in range(-35, 40, 10)]
    floor = [p for p in middles if seen((-3, 0, 2), *p) and seen((2, -1, 1.5), *p)]
    assert 30 < len(floor) < 64 and len(scattered) == len(floor) + 2, (len(scattered), len(floor))
    assert "scattering" in expect(keller("check", "small.xml", cwd=folder), DONE).stdout
    expect(keller("run", "small.xml", "--force", cwd=folder), DONE)
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    with h5py.File(folder / "small.h5", "r") as f:
        kind, triangle, wedge = (f["interactions"][name][()] for name in ["kind", "triangle", "wedge"])
        assert (kind == 3).sum() > 60 and (triangle[kind == 3] != 0xffffffff).all() and (wedge[kind == 3] == 0xffffffff).all()
        assert f["materials/scattering"][0] == 0.6 and f["statistics/complete_scattering"][()] == 1


def test_scattering_with_other_interactions(folder, shared):
    """Beside the paths that are only scattered, those with one reflection or diffraction more, before or behind."""
    write_inputs(folder)
    plain = (folder / "small.xml").read_text().replace('itu="concrete"/>', 'itu="concrete" scattering="0.6"/>')
    rows = {}
    for name, more in [("alone", ""), ("with", ' with-scattering="1"')]:
        (folder / "small.xml").write_text(plain.replace('interactions="2"', f'interactions="2" scattering="1" patch="5 m"{more}'))
        expect(keller("run", "small.xml", "--force", "-q", cwd=folder), DONE)
        rows[name] = json.loads(expect(keller("paths", "small.h5", "--tx", "tx1", "--rx", "rx1", "--format", "json",
                                              cwd=folder), DONE).stdout)["paths"]
    mixed = [row for row in rows["with"] if "S" in row["sequence"] and " " in row["sequence"]]
    assert [row for row in rows["with"] if row not in mixed] == rows["alone"]
    kinds = {"".join(step[0] for step in row["sequence"].split()) for row in mixed}
    assert kinds == {"RS", "SR", "DS", "SD"}, kinds
    shown = expect(keller("check", "small.xml", cwd=folder), DONE).stdout
    assert "one of a path" in shown and "diffractions beside it: at most 1\n" in shown, shown


def test_results_are_the_same_bytes_but_for_the_times(folder, shared):
    """SOURCE_DATE_EPOCH fixes `created`; two runs then differ in the statistics alone."""
    write_inputs(folder)
    sizes = []
    for name in ["a.h5", "b.h5"]:
        expect(keller("run", "small.xml", "-q", "-o", name, cwd=folder, env={**os.environ, "SOURCE_DATE_EPOCH": "86400"}), DONE)
        sizes.append((folder / name).stat().st_size)
        assert "1970-01-02T00:00:00Z" in expect(keller("info", name, cwd=folder), DONE).stdout
    assert sizes[0] == sizes[1]


# ---- reading verbs -----------------------------------------------------------------------------------------------------


def test_info_tells_what_a_file_is(folder, shared):
    result = finished(shared)
    text = expect(keller("info", result), DONE).stdout
    for word in ["tx1, tx2", "map: grid, 5 x 3", "walk: route", "time_total", "3.5 GHz, 28 GHz"]:
        assert word in text, word
    assert "wavelength" in expect(keller("info", shared / "small.xml"), DONE).stdout
    text = expect(keller("info", shared / "scene.obj"), DONE).stdout
    assert "4 triangles" in text and "2 objects" in text
    (folder / "odd.xml").write_text("<!-- <scene> --><?pi?><nothing/>")
    expect(keller("info", "odd.xml", cwd=folder), BAD_INPUT, "odd.xml")
    expect(keller("info", ".", cwd=folder), IO, ".")


def test_paths_as_table_csv_and_json_agree(folder, shared):
    result = finished(shared)
    table = expect(keller("paths", result), DONE).stdout.splitlines()
    rows = list(csv.DictReader(expect(keller("paths", result, "--format", "csv"), DONE).stdout.splitlines()))
    data = json.loads(expect(keller("paths", result, "--format", "json"), DONE).stdout)
    assert data["frequencies_Hz"] == [3.5e9, 28e9]
    assert len(table) - 1 == len(rows) == len(data["paths"]) > RECEIVERS
    for row, path in zip(rows, data["paths"]):
        assert row["tx"] == path["tx"] and row["rx"] == path["rx"] and row["sequence"] == path["sequence"]
        assert float(row["length_m"]) == path["length_m"]
        assert abs(float(row["gain_dB_28000000000Hz"]) - path["gain_dB"][1]) < 1e-6
        assert abs(float(row["arrival_azimuth_deg"]) - path["arrival_azimuth_deg"]) < 1e-6
        if path["sequence"] != "LOS":
            assert all(part[0] in "RD" and part[1:].isdigit() for part in path["sequence"].split())
    los = next(path for path in data["paths"] if path["sequence"] == "LOS" and path["rx"] == "rx1")
    # isotropic, polarisation-matched line of sight over (5, 1, 0.5) m: |gain| = lambda/(4 pi r)
    expected = 20 * math.log10(299792458 / 3.5e9 / (4 * math.pi * math.hypot(5, 1, 0.5)))
    assert abs(los["gain_dB"][0] - expected) < 1e-6


def test_pairs_as_table_csv_and_json_agree(folder, shared):
    result = finished(shared)
    data = json.loads(expect(keller("paths", result, "--format", "json"), DONE).stdout)["paths"]
    pairs = json.loads(expect(keller("paths", result, "--pairs", "--format", "json"), DONE).stdout)["pairs"]
    rows = list(csv.DictReader(expect(keller("paths", result, "--pairs", "--format", "csv", "--rx", "walk"), DONE).stdout.splitlines()))
    table = expect(keller("paths", result, "--pairs", "--tx", "tx2"), DONE).stdout.splitlines()
    assert len(pairs) == 2 * 4 and len(rows) == 2 * 3 and len(table) == 1 + 4 and "ASD/deg" in table[0]
    for pair in pairs:
        mine = [path for path in data if path["tx"] == pair["tx"] and path["rx"] == pair["rx"]]
        assert pair["paths"] == len(mine)
        for f in range(2):
            power = sum(10 ** (path["gain_dB"][f] / 10) for path in mine if path["gain_dB"][f] is not None)
            assert abs(pair["incoherent_dB"][f] - 10 * math.log10(power)) < 1e-9
    for row, pair in zip(rows, [pair for pair in pairs if pair["rx"].startswith("walk")]):
        assert (row["tx"], row["rx"]) == (pair["tx"], pair["rx"]) and float(row["delay_spread_s"]) == pair["delay_spread_s"]
        assert abs(float(row["gain_dB_3500000000Hz"]) - pair["gain_dB"][0]) < 1e-6
        assert float(row["arrival_zenith_spread_deg"]) == pair["arrival_zenith_spread_deg"] > 0
    told = expect(keller("info", result), DONE).stdout
    assert all(line in told for line in table), told
    expect(keller("paths", result, "--pairs", "--strongest", "2"), USAGE, "exclude")


def test_maps_are_exported(folder, shared):
    result = finished(shared)
    expect(keller("export", result, "-o", "all.csv", cwd=folder), DONE)
    rows = list(csv.DictReader((folder / "all.csv").read_text().splitlines()))
    assert len(rows) == 2 * 2 * NX * NY and [row["tx"] for row in rows] == ["tx1"] * 30 + ["tx2"] * 30
    assert [float(rows[1][name]) for name in ["x/m", "y/m", "z/m"]] == [-2, -2, 1.5] and "level/dB" not in rows[0]
    paths = json.loads(expect(keller("paths", result, "--tx", "tx2", "--rx", "map[3]", "--format", "json"), DONE).stdout)["paths"]
    power = sum(10 ** (path["gain_dB"][1] / 10) for path in paths if path["gain_dB"][1] is not None)
    assert abs(float(rows[48]["path_gain_incoherent"]) / power - 1) < 1e-9 and float(rows[48]["arrival_zenith_spread/rad"]) > 0
    expect(keller("export", result, "-o", "all.csv", cwd=folder), IO, "all.csv", "--force")
    expect(keller("export", result, "--grid", "walk", "-o", "no.csv", cwd=folder), USAGE, '"walk"')
    assert names(folder) == ["all.csv"]


def test_paths_are_selected(folder, shared):
    result = finished(shared)

    def listed(*arguments):
        return json.loads(expect(keller("paths", result, "--format=json", *arguments), DONE).stdout)["paths"]

    every = listed()
    assert listed("--tx", "tx2") == [path for path in every if path["tx"] == "tx2"] != []
    assert listed("--rx", "walk[1]") == [path for path in every if path["rx"] == "walk[1]"] != []
    assert listed("--rx", "walk") == [path for path in every if path["rx"].startswith("walk[")] != []
    for count in [1, 2, 1000]:
        strongest = listed("--strongest", count)
        pairs = {}
        for path in every:
            pairs.setdefault((path["tx"], path["rx"]), []).append(path)
        expected = [path for pair in pairs.values()
                    for path in sorted(pair, key=lambda p: -p["gain_dB"][0] if p["gain_dB"][0] is not None else 1e9)[:count]]
        assert [p["gain_dB"][0] for p in strongest] == [p["gain_dB"][0] for p in expected]
    expect(keller("paths", result, "--tx", "nobody"), USAGE, "nobody", "tx1, tx2")
    expect(keller("paths", result, "--rx", "walk[3]"), USAGE, "walk[3]")


def test_damaged_results_are_bad_input(folder, shared):
    good = finished(shared).read_bytes()
    bad = folder / "bad.h5"
    for name, content in [("empty", b""), ("text", b"hello"), ("half", good[:len(good) // 2]), ("head", good[:200]),
                          ("signature", good[:8] + b"\xff" * 500)]:
        bad.write_bytes(content)
        for verb in [["info"], ["paths"], ["plot", "-o", "bad.png"]]:
            done = keller(*verb, "bad.h5", cwd=folder)
            assert done.returncode == BAD_INPUT and "bad.h5" in done.stderr, (name, verb, done.returncode, done.stderr)
    # A byte here and there: an answer or an error, in bounded time, never a crash.
    for step in range(40):
        at = 8 + step * (len(good) - 9) // 40
        bad.write_bytes(good[:at] + bytes([good[at] ^ 0xff]) + good[at + 1:])
        done = keller("paths", "bad.h5", cwd=folder)
        assert done.returncode in (DONE, BAD_INPUT), (at, done.returncode, done.stderr)
    assert names(folder) == ["bad.h5"]


def test_a_text_of_four_gigabytes_is_not_believed(folder, shared):
    """The length of a stored text is damaged: refused before memory of that size is touched."""
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    bad = folder / "bad.h5"
    shutil.copy(finished(shared), bad)
    with h5py.File(bad, "r+") as f:
        texts = f["transmitters/id"][()]
        del f["transmitters/id"]
        data = f.create_dataset("transmitters/id", data=texts, dtype=h5py.string_dtype())   # contiguous: patched below
        f.flush()
        at = data.id.get_offset()
    content = bytearray(bad.read_bytes())
    assert struct.unpack_from("<I", content, at)[0] == len("tx1"), "not where the length is"
    content[at:at + 4] = struct.pack("<I", 0xf0000000)
    bad.write_bytes(content)
    for verb in [["info"], ["paths"], ["plot", "-o", "bad.png"]]:
        run = subprocess.Popen([PROGRAM, *verb, "bad.h5"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True)
        error = run.stderr.read()
        run.stderr.close()
        _, status, usage = os.wait4(run.pid, 0)
        run.returncode = os.waitstatus_to_exitcode(status)
        assert run.returncode == BAD_INPUT and "bad.h5" in error, (verb, run.returncode, error)
        assert usage.ru_maxrss < 1 << 20, (verb, usage.ru_maxrss)    # KiB: below 1 GiB


# ---- maps that follow the ground ------------------------------------------------------------------------------------


HILL = """o hill
v -4 -2 1
v 2 -2 4
v 2 2 4
v -4 2 1
f 1 2 3 4
o roof
v -1 -1 8
v 1 -1 8
v 1 1 8
v -1 1 8
f 5 6 7 8
"""


def check_exports(folder, z, gain):
    """The map of all.h5, as CSV, as JSON, and as ParaView would find it."""
    import h5py
    import numpy
    for ending in ["csv", "json", "xdmf"]:
        expect(keller("export", "all.h5", "-o", "map." + ending, cwd=folder), DONE)
        expect(keller("export", "all.h5", "-o", "map." + ending, cwd=folder), IO, "--force")
    rows = [line.split(",") for line in (folder / "map.csv").read_text().splitlines()]
    assert rows[0][:6] == ["tx", "frequency/Hz", "x/m", "y/m", "z/m", "path_gain"] and len(rows) == 1 + 2 * 2 * 15, rows[0]
    values = numpy.array([[float(cell) for cell in row[1:6]] for row in rows[1:]])
    assert [row[0] for row in rows[1::30]] == ["tx1", "tx2"] and list(values[::15, 0]) == [3.5e9, 28e9] * 2
    assert list(values[:5, 1]) == [-4, -2, 0, 2, 4] and list(values[::5, 2][:3]) == [-2, 0, 2]
    assert numpy.array_equal(values[:, 3], numpy.tile(z.ravel(), 4), equal_nan=True)
    assert numpy.array_equal(values[:, 4], gain.ravel(), equal_nan=True)
    data = json.loads((folder / "map.json").read_text())
    assert data["grid"] == "map" and data["x_m"] == [-4, -2, 0, 2, 4] and data["z_m"][0][4] is None
    assert numpy.array_equal(numpy.array([m["path_gain"] for m in data["maps"]], float), gain, equal_nan=True)
    slabs = []
    with h5py.File(folder / "all.h5") as f:
        for item in ElementTree.parse(folder / "map.xdmf").getroot().iter("DataItem"):
            if item.get("Format") == "HDF":
                file, path = item.text.split(":")
                assert file == "all.h5" and f[path].shape == tuple(map(int, item.get("Dimensions").split())), item.text
            if item.get("ItemType") == "HyperSlab":
                begin, stride, count = numpy.array(list(map(int, item[0].text.split()))).reshape(3, -1)
                assert (stride == 1).all() and count.prod() == numpy.prod(list(map(int, item.get("Dimensions").split())))
                slabs.append(f[item[1].text.split(":")[1]][tuple(slice(b, b + c) for b, c in zip(begin, count))])
    assert slabs[0].shape == (15, 3) and numpy.array_equal(slabs[0][:, 2], z.ravel(), equal_nan=True)
    assert len(slabs) == 9 and numpy.array_equal(numpy.concatenate(slabs[1:5], axis=1)[0].reshape(gain.shape), gain, equal_nan=True)
    expect(keller("export", "all.h5", "-o", "map.vtk", cwd=folder), USAGE, ".xdmf")
    expect(keller("export", "all.h5", "--tx", "tx1", "-o", "b.csv", cwd=folder), USAGE, "--tx")
    expect(keller("export", "all.h5", "--grid", "none", "-o", "b.csv", cwd=folder), USAGE, '"none"')


def test_a_map_follows_the_ground(folder, shared):
    """The hill is z = 3 + x/2 up to x = 2 m: columns x = -4, -2, 0, 2 of the map have ground, x = 4 has none."""
    (folder / "hill.obj").write_text(HILL)
    over = CONFIG.replace("scene.obj", "hill.obj").replace("STEP", "2 m").replace('z="2 m"', 'z="12 m"').replace(
        '  <receivers id="walk" file="walk.csv"/>\n', "")
    over = over.replace('<grid id="map" z="1.5 m">', '<grid id="map" height="1.5 m"> <over object="hill"/>')
    (folder / "hill.xml").write_text(over)
    (folder / "all.xml").write_text(over.replace('<over object="hill"/>', ""))
    (folder / "wrong.xml").write_text(over.replace('object="hill"', 'object="hil"'))
    done = expect(keller("check", "hill.xml", cwd=folder), DONE).stdout
    for words in ['1.5 m over object "hill", z from 2.5 to 5.5 m', "3 of 15 cells have no surface below them: NaN"]:
        assert words in done, done
    expect(keller("check", "wrong.xml", cwd=folder), BAD_INPUT, "wrong.xml:11", '"hil"', 'did you mean "hill"?')
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    for name, middle in [("hill", 4.5), ("all", 9.5)]:
        assert "3 of 15 cells" in expect(keller("run", name + ".xml", cwd=folder), DONE).stdout
        with h5py.File(folder / (name + ".h5")) as f:
            z, gain = f["coverage/map/z"][()], f["coverage/map/path_gain"][()]
            for column, expected in enumerate([2.5, 3.5, 4.5, 5.5]):
                assert (abs(z[[0, 2], column] - expected) < 1e-12).all(), z
            assert z[1, 2] == middle and (z[:, 4] != z[:, 4]).all(), z
            assert (gain[:, :, :, 4] != gain[:, :, :, 4]).all() and (gain[:, :, :, :4] > 0).all(), gain
            assert (f["receivers/position"][1:, 2].reshape(3, 5)[:, :4] == z[:, :4]).all()
    check_exports(folder, z, gain)
    need_gnuplot()
    expect(keller("plot", "hill.h5", "-o", "hill.svg", cwd=folder), DONE)
    text = (folder / "hill.svg").read_text()
    assert "z = 2.5 to 5.5 m" in text and "lines of equal height every 0.5 m" in text


# ---- plot ---------------------------------------------------------------------------------------------------------------


def need_gnuplot():
    if not shutil.which("gnuplot"):
        raise Skip("gnuplot is not installed")


def png_size(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[12:16] == b"IHDR" and data[-8:-4] == b"IEND", "not a complete PNG"
    return struct.unpack(">II", data[16:24])


def test_plots_are_png_and_svg(folder, shared):
    need_gnuplot()
    result = finished(shared)
    for what, more in [("coverage", []), ("coverage", ["--tx", "tx2", "--frequency", "2", "--grid", "map"]), ("delay", []),
                       ("coverage", ["--sum", "incoherent"]), ("arrival-zenith-spread", []), ("paths", ["--rx", "walk"])]:
        expect(keller("plot", result, "--what", what, *more, "-o", "a.png", "--force", cwd=folder), DONE)
        width, height = png_size(folder / "a.png")
        assert 400 < width < 2000 and 200 < height < 2000 and (folder / "a.png").stat().st_size > 4000
    # The grid shows 10 m by 6 m: in true aspect ratio wider than high, margins included.
    expect(keller("plot", result, "-o", "b.png", cwd=folder), DONE)
    width, height = png_size(folder / "b.png")
    assert width > height
    expect(keller("plot", result, "-o", "b.svg", cwd=folder), DONE)
    root = ElementTree.parse(folder / "b.svg").getroot()
    text = " ".join("".join(element.itertext()) for element in root.iter() if element.tag.endswith("text"))
    for word in ["x / m", "y / m", "path gain / dB", "tx1", "3.5 GHz"]:
        assert word in text, (word, text)
    assert names(folder) == ["a.png", "b.png", "b.svg"]


def test_a_picture_of_paths_says_whose_they_are(folder, shared):
    need_gnuplot()
    result = finished(shared)
    data = json.loads(expect(keller("paths", result, "--format", "json"), DONE).stdout)["paths"]

    def words_of(*arguments):
        expect(keller("plot", result, "--what", "paths", *arguments, "-o", "p.svg", "--force", cwd=folder), DONE)
        root = ElementTree.parse(folder / "p.svg").getroot()
        return ["".join(element.itertext()).strip() for element in root.iter() if element.tag.endswith("text")]

    words = words_of("--tx", "tx2", "--rx", "rx1")
    gains = [path["gain_dB"][0] for path in data if path["tx"] == "tx2" and path["rx"] == "rx1"]
    near = [gain for gain in gains if gain is not None and gain >= max(g for g in gains if g is not None) - 60]
    for word in ["tx2", "rx1", "tx2 to rx1, 3.5 GHz", f"{len(near)} of {len(gains)} paths: those within 60 dB of the strongest"]:
        assert word in words, (word, words)
    words = words_of("--rx", "walk[1]")
    assert "tx1 to walk[1], 3.5 GHz" in words and "walk[1]" in words and "walk[0]" not in words, words
    words = words_of()    # 19 receivers: each has its name
    for word in ["tx1 to all receivers, 3.5 GHz", "rx1"] + [f"walk[{i}]" for i in range(3)] + [f"map[{i}]" for i in range(15)]:
        assert word in words, (word, words)
    # 1 + 3 + 45 receivers: each set has its name
    write_inputs(folder, "1 m")
    expect(keller("run", "small.xml", "-q", cwd=folder), DONE)
    result = folder / "small.h5"
    words = words_of()
    assert {"rx1", "walk", "map"} <= set(words) and "walk[0]" not in words, words


def test_plot_errors(folder, shared):
    need_gnuplot()
    result = finished(shared)
    (folder / "mine.png").write_text("mine")
    expect(keller("plot", result, "-o", "mine.png", cwd=folder), IO, "mine.png", "--force")
    assert (folder / "mine.png").read_text() == "mine"
    expect(keller("plot", result, "-o", "none/a.png", cwd=folder), IO, "none/a.png")
    expect(keller("plot", result, "--tx", "nobody", "-o", "a.png", cwd=folder), USAGE, "nobody")
    expect(keller("plot", result, "--grid", "walk", "-o", "a.png", cwd=folder), USAGE, "walk")
    expect(keller("plot", result, "--frequency", "3", "-o", "a.png", cwd=folder), USAGE, "--frequency")
    done = keller("plot", result, "-o", "a.png", cwd=folder, env={**os.environ, "PATH": str(folder)})
    expect(done, FAILED, "gnuplot", "a.png", "install")
    (folder / "gnuplot").write_text("#!/bin/sh\necho 'line 1: no colours today' >&2\nexit 1\n")
    (folder / "gnuplot").chmod(0o700)
    done = keller("plot", result, "-o", "a.png", cwd=folder, env={**os.environ, "PATH": str(folder)})
    expect(done, FAILED, "no colours today")
    assert names(folder) == ["gnuplot", "mine.png"]


def main(scope):
    """Runs the cases among these names, those whose words the command line has where it has any."""
    cases = [(name[5:].replace("_", " "), case) for name, case in scope.items() if name.startswith("test_")]
    chosen = [(name, case) for name, case in cases if all(word in name for word in sys.argv[1:])]
    print(f"1..{len(chosen)}", flush=True)
    failed = 0
    with tempfile.TemporaryDirectory() as shared:
        for number, (name, case) in enumerate(chosen, 1):
            try:
                with tempfile.TemporaryDirectory() as folder:
                    case(pathlib.Path(folder), pathlib.Path(shared))
                print(f"ok {number} - {name}", flush=True)
            except Skip as reason:
                print(f"ok {number} - {name} # SKIP {reason}", flush=True)
            except Exception as problem:  # a case that cannot go on has failed, whatever the reason
                failed += 1
                print(f"not ok {number} - {name}", flush=True)
                for line in f"{type(problem).__name__} at line {problem.__traceback__.tb_next.tb_lineno}: {problem}".splitlines():
                    print(f"# {line}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(globals()))
