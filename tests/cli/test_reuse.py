"""keller run --reuse: fields from stored geometry are those of a fresh run, bit for bit; what is not the same geometry is refused.
Speaks TAP."""
import shutil
import sys

sys.dont_write_bytecode = True
from test_program import BAD_INPUT, DONE, IO, SCENE, USAGE, Skip, expect, keller, main, names

# Two edges of a post 3 cm thick are one at 2.1 GHz: then paths over both have no field, and only a dynamic range of more than a double
# has, as below, keeps them. tx to "behind" grazes the wall's end; of tx to "corner", floor and wall commute.
POST = """o post
v 0 1 0
v 0.03 1 0
v 0.03 1.03 0
v 0 1.03 0
v 0 1 2
v 0.03 1 2
v 0.03 1.03 2
v 0 1.03 2
f 9 10 14 13
f 10 11 15 14
f 11 12 16 15
f 12 9 13 16
f 13 14 15 16
"""
RADIO = """<?xml version="1.0"?>
<simulation version="1" domain="rf">
  <scene file="scene.obj"/>
  <frequency>3.5 GHz</frequency>
  <material name="ground" permittivity="5" conductivity="0.01 S/m" scattering="0.4"/>
  <material name="wall" itu="concrete" thickness="30 cm"/>
  <default-material name="wall"/>
  <assign object="floor" material="ground"/>
  <transmitter id="tx"> <position x="-3 m" y="0 m" z="2 m"/> </transmitter>
  <receiver id="corner"> <position x="2 m" y="0 m" z="2 m"/> </receiver>
  <receiver id="behind"> <position x="13 m" y="8 m" z="2 m"/> </receiver>
  <receivers id="walk" file="walk.csv"/>
  <grid id="map" z="1.5 m"> <from x="-4 m" y="-2 m"/> <to x="4 m" y="6 m"/> <step>8 m</step> </grid>
  <grid id="ground" height="2 m"> <from x="-4 m" y="-2 m"/> <to x="400 m" y="-2 m"/> <step>202 m</step> </grid>
  <paths reflections="2" diffractions="2" transmissions="1" scattering="1" with-scattering="1" patch="20 m" interactions="3" dynamic-range="4000 dB"/>
  <output scene="no" coverage="no"/>
</simulation>
"""
# everything that may change, changed
OTHER_RADIO = [
    ("<frequency>3.5 GHz</frequency>", "<frequency>2.1 GHz</frequency> <frequency>28 GHz</frequency>"),
    ('permittivity="5" conductivity="0.01 S/m" scattering="0.4"', 'itu="marble" scattering="0.7"'),
    ('itu="concrete" thickness="30 cm"', 'permittivity="3" thickness="4 cm"'),
    ('z="2 m"/> </transmitter>', 'z="2 m"/> <antenna pattern="tr38901" polarization="H"> <element/> <element y="5 cm" phase="40 deg"/> '
     '</antenna> <orientation yaw="20 deg" pitch="10 deg"/> <velocity x="30 m/s" y="1 m/s"/> <power>3 W</power> </transmitter>'),
    ('file="walk.csv"/>', 'file="walk.csv"> <antenna pattern="dipole"/> <orientation roll="30 deg"/> <velocity y="2 m/s"/> </receivers>'),
    ('interactions="3"', 'interactions="3" wedge="holm"'), ('<output scene="no" coverage="no"/>', ""),
]
SOUND = """<?xml version="1.0"?>
<simulation version="1" domain="acoustic">
  <scene file="scene.obj"/>
  <frequency>250 Hz</frequency>
  <medium speed="340 m/s" absorption="none"/>
  <material name="hard" rigid="yes"/>
  <default-material name="hard"/>
  <transmitter id="tx"> <position x="-3 m" y="0 m" z="2 m"/> </transmitter>
  <receiver id="rim"> <position x="1 m" y="4 m" z="3 m"/> </receiver>
  <receiver id="behind"> <position x="1 m" y="8 m" z="1 m"/> </receiver>
  <grid id="map" z="1.5 m"> <from x="-4 m" y="-2 m"/> <to x="4 m" y="6 m"/> <step>8 m</step> </grid>
  <paths reflections="2" diffractions="1" dynamic-range="4000 dB"/>
  <solver diffraction="utd"/>
  <response rate="8 kHz" duration="60 ms"/>
</simulation>
"""
OTHER_SOUND = [
    ("<frequency>250 Hz</frequency>", '<bands from="125 Hz" to="1 kHz"/>'),
    ('speed="340 m/s" absorption="none"', 'temperature="12 degC" humidity="30 %" absorption="iso9613"'),
    ('z="2 m"/> </transmitter>', 'z="2 m"/> <directivity pattern="cardioid"/> <orientation yaw="50 deg"/> <level power="90 dB"/> </transmitter>'),
    ('rate="8 kHz" duration="60 ms"', 'rate="4 kHz" duration="80 ms" tail="yes" volume="300 m3"'),
]


def h5(path, mode="r"):
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    return h5py.File(path, mode)


def changed(text, changes):
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def run(folder, text, result, *more):
    (folder / "c.xml").write_text(text)
    return keller("run", "c.xml", "-q", "-o", result, "--force", *more, cwd=folder)


def stored(folder, text, shared=None):
    """The scene, and a.h5, the result that others are made from; in the shared folder it is that of RADIO."""
    (folder / "scene.obj").write_text(SCENE + POST)
    (folder / "walk.csv").write_text("x,y,z\n0,-3,1.5\n1,6,1.5\n")
    if shared is None or not (shared / "a.h5").exists():
        expect(run(folder, text, "a.h5"), DONE)
        if shared is not None:
            shutil.copy(folder / "a.h5", shared / "a.h5")
    else:
        shutil.copy(shared / "a.h5", folder / "a.h5")


COUNTS = ["boundary_paths", "cornered_paths", "crowded_paths", "dropped_paths", "dropped_bound", "edges_as_one", "valid_paths"]


def content(path):
    """Every dataset, as bytes, but for statistics that are of the machine."""
    import h5py
    import numpy
    found = {}
    with h5(path) as f:
        def visit(name, item):
            if isinstance(item, h5py.Dataset) and (not name.startswith("statistics/") or name[11:] in COUNTS):
                data = numpy.asarray(item[()])
                found[name] = (data.shape, str(data.dtype), data.tolist() if data.dtype == object else data.tobytes())
        f.visititems(visit)
    return found


def same(folder, first, second):
    a, b = content(folder / first), content(folder / second)
    assert a.keys() == b.keys(), a.keys() ^ b.keys()
    different = [name for name in a if a[name] != b[name]]
    assert not different, different


def test_radio_is_computed_anew(folder, shared):
    """Reflected, diffracted twice, over a thin post, through walls, scattered, exactly on boundaries: to other materials, antennas,
    frequencies, and back again."""
    stored(folder, RADIO, shared)
    other = changed(RADIO, OTHER_RADIO)
    expect(run(folder, other, "fresh.h5"), DONE)
    done = expect(run(folder, other, "b.h5", "--reuse", "a.h5"), DONE)
    with h5(folder / "a.h5") as a, h5(folder / "b.h5") as b:
        weight, kind = a["paths/weight"][()], a["interactions/kind"][()]
        assert set(kind) == {0, 1, 2, 3} and (weight < 1).sum() > 2 and (a["paths/patch"][()] > 0).any()
        assert (a["interactions/free_end"][()] > 0).any() and b["statistics/edges_as_one"][()] > 0
        assert "coverage/map" not in a and b["coverage/map/path_gain"].shape == (1, 2, 2, 2)
        assert b["statistics/reused_paths"][()] == len(weight) and b["statistics/candidates"][()] == 0
        assert abs(b["paths/doppler"][()]).max() > 100 and b.attrs["command_line"].endswith("--reuse a.h5")
    same(folder, "b.h5", "fresh.h5")
    assert f"{len(weight)} paths of a.h5; nothing was searched" in done.stdout and "missing" not in done.stdout
    expect(run(folder, RADIO, "back.h5", "--reuse", "b.h5", "-j", "1"), DONE)
    same(folder, "back.h5", "a.h5")


def test_what_is_reflected_after_scattering(folder, shared):
    """A scattered path was solved as two, to the patch and from there: mirrored from the patch, not from the receiver."""
    (folder / "scene.obj").write_text(SCENE + POST)
    (folder / "walk.csv").write_text("x,y,z\n0,-3,1.5\n1.37,5.71,1.53\n")
    text = changed(RADIO, [('diffractions="2"', 'diffractions="0"'), ('patch="20 m"', 'patch="1.7 m"')])
    expect(run(folder, text, "a.h5"), DONE)
    expect(run(folder, text, "b.h5", "--reuse", "a.h5"), DONE)
    same(folder, "a.h5", "b.h5")
    with h5(folder / "a.h5") as f:
        offset, kind = f["paths/offset"][()], f["interactions/kind"][()]
        assert any(list(kind[first:end]) == [3, 0] for first, end in zip(offset, offset[1:]))


def test_sound_is_computed_anew(folder, shared):
    """Levels, maps and impulse responses, of edges by either method, at another temperature."""
    for method in "utd", "btm":
        text = SOUND.replace('"utd"', f'"{method}"')
        stored(folder, text)
        other = changed(text, OTHER_SOUND)
        if method == "utd":
            other = other.replace('rigid="yes"', 'impedance="8-3j" scattering="0.1"')
        expect(run(folder, other, "fresh.h5"), DONE)
        expect(run(folder, other, "b.h5", "--reuse", "a.h5"), DONE)
        with h5(folder / "b.h5") as f:
            parts = f["paths/part"][()]
            assert (parts[:, 1] > parts[:, 0]).any() == (method == "btm") and f["responses/tail"].shape == (2, 320)
        same(folder, "b.h5", "fresh.h5")


def test_another_geometry_is_refused(folder, shared):
    stored(folder, RADIO, shared)
    lines = RADIO.splitlines()

    def line(word):
        return 1 + next(i for i, text in enumerate(lines) if word in text)

    for old, new, where, words in [
        ('x="-3 m" y="0 m" z="2 m"', 'x="-3 m" y="1 um" z="2 m"', "<transmitter", ["tx is at (-3, 1e-06, 2) m", "(-3, 0, 2)"]),
        ('x="13 m"', 'x="14 m"', '"behind"', ["behind is at (14, 8, 2) m"]),
        ("8 m</step>", "4 m</step>", '"corner"', ["16 receivers", "11 in 5"]),
        ('"map" z="1.5 m"', '"map" z="1.6 m"', "<grid", ["map[0] is at (-4, -2, 1.6) m"]),
        ('reflections="2"', 'reflections="1"', "<paths", ["reflections is 1 here and 2"]),
        ('transmissions="1"', 'transmissions="0"', "<paths", ["transmissions is 0 here and 1"]),
        ('interactions="3"', 'interactions="2"', "<paths", ["interactions is 2 here and 3"]),
        ('patch="20 m"', 'patch="10 m"', "<paths", ["patch is 10 m here and 20 m"]),
        (' thickness="30 cm"', "", '"wall" itu', ['material "wall" does not let waves through here and does in']),
        (' scattering="0.4"', "", '"ground" perm', ['material "ground" does not scatter here and does in']),
        ('<scene file="scene.obj"/>', '<scene file="scene.obj" scale="1.5"/>', "<scene", ["other triangles, faces or wedges"]),
    ]:
        done = run(folder, changed(RADIO, [(old, new)]), "b.h5", "--reuse", "a.h5")
        expect(done, BAD_INPUT, f"c.xml:{line(where)}: ", "a.h5", "expected", *words)
    expect(run(folder, SOUND, "b.h5", "--reuse", "a.h5"), BAD_INPUT, "c.xml:2: ", 'domain is "acoustic" here and "rf"')
    expect(run(folder, RADIO, "a.h5", "--reuse", "a.h5"), IO, "a.h5", "reuses")
    expect(run(folder, RADIO, "b.h5", "--reuse", "none.h5"), IO, "none.h5")
    expect(run(folder, RADIO, "b.h5", "--reuse", "scene.obj"), BAD_INPUT, "scene.obj", "not an HDF5 file")
    expect(run(folder, RADIO, "b.h5", "--reuse"), USAGE, "--reuse")
    assert names(folder) == ["a.h5", "c.xml", "scene.obj", "walk.csv"]
    expect(run(folder, RADIO.replace('scene="no"', 'paths="no"'), "a.h5"), DONE)
    expect(run(folder, RADIO, "b.h5", "--reuse", "a.h5"), BAD_INPUT, "a.h5: holds no paths", '<output paths="yes"/>')


def test_what_was_dropped_is_told(folder, shared):
    """40 dB below the strongest is dropped: that range and smaller ones are served, and told; a larger one is refused."""
    stored(folder, RADIO.replace("4000 dB", "40 dB"))
    with h5(folder / "a.h5") as f:
        dropped, bound, kept = (f["statistics/" + name][()] for name in ("dropped_paths", "dropped_bound", "valid_paths"))
    assert 0 < dropped < kept
    paths = 1 + next(i for i, text in enumerate(RADIO.splitlines()) if "<paths" in text)
    expect(run(folder, RADIO.replace("4000 dB", "41 dB"), "b.h5", "--reuse", "a.h5"), BAD_INPUT, f"c.xml:{paths}: ", "41 dB",
           f"{dropped:.0f} at 40 dB")
    done = expect(run(folder, RADIO.replace("4000 dB", "30 dB"), "b.h5", "--reuse", "a.h5"), DONE)
    assert f"{dropped:.0f} that it had dropped as too weak: there of a pair together {bound:.1f} dB" in done.stdout, done.stdout
    expect(run(folder, RADIO.replace("4000 dB", "25 dB"), "c.h5", "--reuse", "b.h5"), DONE)
    with h5(folder / "b.h5") as b, h5(folder / "c.h5") as c:
        assert b["statistics/reused_dropped_paths"][()] == dropped and abs(b["statistics/reused_dropped_bound"][()] - bound) < 1e-9
        own = b["statistics/dropped_paths"][()]
        assert own > 0 and c["statistics/reused_dropped_paths"][()] == dropped + own
    expect(run(folder, RADIO.replace("4000 dB", "40 dB"), "c.h5", "--reuse", "b.h5"), BAD_INPUT, "40 dB")


def test_damaged_geometry_is_bad_input(folder, shared):
    stored(folder, RADIO, shared)

    def damage(name, at, value):
        shutil.copy(folder / "a.h5", folder / "bad.h5")
        with h5(folder / "bad.h5", "r+") as f:
            if name == "geometry":
                del f[name]
            else:
                f[name][at] = value
        return run(folder, RADIO, "b.h5", "--reuse", "bad.h5")

    with h5(folder / "a.h5") as f:
        kind = list(f["interactions/kind"])
        wedge, face = kind.index(1), kind.index(0)
        position = f["interactions/position"][face]
    for name, at, value, words in [
        ("interactions/wedge", wedge, 1000, ["does not fit the scene"]), ("interactions/triangle", face, 1000, ["does not fit the scene"]),
        ("interactions/position", face, position + 1e-3, ["does not fit its sequence"]),
        ("interactions/position", face, float("nan"), ["does not fit its sequence"]),
        ("paths/weight", 0, 2, ["numbers that are none"]), ("paths/length", 0, float("inf"), ["numbers that are none"]),
        ("paths/length", 1, 1, ["does not fit its sequence"]), ("paths/rx", 0, 3, ["out of order"]), ("paths/tx", 0, 7, ["path 0 names"]),
        ("geometry", 0, 0, ["did not store all"]),
    ]:
        expect(damage(name, at, value), BAD_INPUT, "bad.h5: ", *words)
    assert names(folder) == ["a.h5", "bad.h5", "c.xml", "scene.obj", "walk.csv"]


if __name__ == "__main__":
    sys.exit(main(globals()))
