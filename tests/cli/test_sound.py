"""Runs the program on sound as a user does: the shipped configurations, the result's datasets, sound files, maps. Speaks TAP."""
import math
import struct
import subprocess
import sys

sys.dont_write_bytecode = True
from test_program import BAD_INPUT, DONE, IO, SCENE, SOURCE, USAGE, Skip, expect, keller, main, names, need_gnuplot, png_size

CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<simulation version="1" domain="acoustic">
  <scene file="scene.obj"/>
  <frequency>250 Hz</frequency>
  <frequency>1 kHz</frequency>
  <medium speed="340 m/s" absorption="none"/>
  <material name="floor" MATERIAL/>
  <default-material name="floor"/>
  <transmitter id="s"> <position x="-3 m" y="0 m" z="2 m"/> <level pressure="90 84 dB"/> </transmitter>
  <receiver id="r"> <position x="2 m" y="-1 m" z="1.5 m"/> </receiver>
  <receiver id="q"> <position x="0 m" y="0 m" z="1 m"/> </receiver>
  <grid id="map" z="1.5 m"> <from x="-4 m" y="-2 m"/> <to x="4 m" y="2 m"/> <step>2 m</step> </grid>
  <paths reflections="1"/>
  <response rate="32 kHz" duration="100 ms"/>
</simulation>
"""


def h5(path):
    try:
        import h5py
    except ImportError:
        raise Skip("this Python has no h5py")
    return h5py.File(path)


def run(folder, material='rigid="yes"', *more, change=("", "")):
    (folder / "scene.obj").write_text(SCENE.partition("o wall")[0])
    (folder / "c.xml").write_text(CONFIG.replace("MATERIAL", material).replace(*change))
    return keller("run", "c.xml", "-o", "c.h5", "--force", *more, cwd=folder)


def test_the_result_holds_sound(folder, shared):
    expect(run(folder), DONE)
    with h5(folder / "c.h5") as f:
        assert f.attrs["domain"] == "acoustic" and "transfer" not in f["paths"]
        assert f["medium/speed"][()] == 340 and list(f["medium/absorption"]) == [0, 0] and f["medium/speed"].attrs["units"] == "m/s"
        assert [list(row) for row in f["transmitters/level"]] == [[90, 84]] and f["transmitters/level"].attrs["units"] == "dB"
        assert list(f["materials/absorption"][0]) == [0, 0] and list(f["materials/scattering"]) == [0]
        # two paths each: the floor's image doubles the path's end
        here = [i for i, rx in enumerate(f["paths/rx"]) if rx == 0]
        lengths = [math.dist((-3, 0, z), (2, -1, 1.5)) for z in (2, -2)]
        for i, r in zip(here, lengths):
            assert abs(f["paths/length"][i] - r) < 1e-12 and abs(f["paths/delay"][i] - r / 340) < 1e-15
            for j, frequency in enumerate((250, 1000)):
                phase = -2 * math.pi * frequency * r / 340
                assert abs(f["paths/gain"][i, j] - complex(math.cos(phase), math.sin(phase)) / r) < 1e-12
        table = expect(keller("paths", "c.h5", "--rx", "r", cwd=folder), DONE).stdout.splitlines()
        assert "delay/ms" in table[0] and f"{1e3 * lengths[0] / 340:.4f}" in table[1]
        # a cell of the map: tones, so the level is that of the sum
        level, weighted = f["coverage/map/level"][0, :, 0, 0], f["coverage/map/level_a"][0, 0, 0]
        gain = f["coverage/map/path_gain"][0, :, 0, 0]
        for j, source in enumerate((90, 84)):
            assert abs(level[j] - source - 10 * math.log10(gain[j])) < 1e-9
        a = [-8.6, 0]  # dB, IEC 61672-1, table 3
        assert abs(weighted - 10 * math.log10(sum(10 ** ((l + w) / 10) for l, w in zip(level, a)))) < 0.1
        assert f["responses/pressure"].shape == (2, 3200) and f["responses/rate"][()] == 32000
        assert len(f["responses/bands"]) == 8 and f["responses/t30"].attrs["units"] == "s"
        assert abs(f["responses/arrival"][0] - lengths[0] / 340) < 1e-12


def wave(path):
    """Rate and samples of a file of 32-bit floats, read by hand."""
    data = path.read_bytes()
    assert data[:4] == b"RIFF" and data[8:12] == b"WAVE" and struct.unpack("<I", data[4:8])[0] == len(data) - 8
    at, found = 12, {}
    while at < len(data):
        name, size = data[at:at + 4], struct.unpack("<I", data[at + 4:at + 8])[0]
        found[name] = data[at + 8:at + 8 + size]
        at += 8 + size + size % 2
    kind, channels, rate = struct.unpack("<HHI", found[b"fmt "][:8])
    assert kind == 3 and channels == 1
    return rate, struct.unpack(f"<{len(found[b'data']) // 4}f", found[b"data"])


def test_responses_are_exported(folder, shared):
    expect(run(folder, 'absorption="0.19"'), DONE)
    expect(keller("export", "c.h5", "-o", "r.wav", cwd=folder), DONE)
    rate, samples = wave(folder / "r.wav")
    assert rate == 32000 and len(samples) == 3200 and max(map(abs, samples)) <= 1
    first = math.dist((-3, 0, 2), (2, -1, 1.5)) / 340 * 32000
    assert abs(max(range(3200), key=lambda i: abs(samples[i])) - first) <= 0.5
    # all of the energy below the Nyquist frequency: sum of the paths' amplitudes at 0 Hz
    total = sum(a / math.dist((-3, 0, z), (2, -1, 1.5)) for z, a in ((2, 1), (-2, 0.9)))
    assert abs(sum(samples) - total) < 1e-3 * total
    expect(keller("export", "c.h5", "--rx", "q", "-o", "q.wav", cwd=folder), DONE)
    assert wave(folder / "q.wav")[1] != samples
    expect(keller("export", "c.h5", "-o", "r.wav", cwd=folder), IO, "r.wav", "exists")
    before = (folder / "r.wav").read_bytes()
    expect(keller("export", "c.h5", "--force", "-o", "r.wav", cwd=folder), DONE)
    assert (folder / "r.wav").read_bytes() == before
    expect(keller("export", "c.h5", "--rx", "map[0]", "-o", "m.wav", cwd=folder), USAGE, "no impulse response of that pair")
    expect(keller("export", "c.h5", "--rx", "nobody", "-o", "m.wav", cwd=folder), USAGE, "nobody")
    expect(keller("export", "c.h5", "-o", "m.flac", cwd=folder), USAGE, ".wav")
    expect(run(folder, change=('<response rate="32 kHz" duration="100 ms"/>', "")), DONE)
    expect(keller("export", "c.h5", "-o", "m.wav", cwd=folder), BAD_INPUT, "holds no impulse response")
    assert names(folder) == ["c.h5", "c.xml", "q.wav", "r.wav", "scene.obj"]


def test_threads_change_nothing(folder, shared):
    """Responses, levels and paths bit for bit, with edges by either method, a tail, and more bins than one thread takes at once."""
    for more in "", '<solver diffraction="btm"/>':
        results = []
        for threads in "1", "2", "5":
            expect(run(folder, 'rigid="yes"', "-j", threads, change=(
                '<paths reflections="1"/>\n  <response rate="32 kHz" duration="100 ms"/>',
                f'<paths reflections="2" diffractions="1"/>{more}<response rate="32 kHz" duration="200 ms" tail="yes" volume="90 m3"/>')), DONE)
            with h5(folder / "c.h5") as f:
                assert any(f["interactions/kind"][:] == 1)
                results.append([f[name][:].tobytes() for name in ("responses/pressure", "responses/tail", "coverage/map/level",
                                                                  "coverage/map/level_a", "paths/gain")])
        assert results[0] == results[1] == results[2]


def test_the_tail_knows_what_was_computed(folder, shared):
    """Three reflections, but one interaction: the response and its tail are those of one reflection."""
    responses = []
    for paths in 'reflections="1"', 'reflections="3" interactions="1"':
        expect(run(folder, 'absorption="0.3"', change=('<paths reflections="1"/>\n  <response rate="32 kHz" duration="100 ms"/>',
               f'<paths {paths}/><response rate="8 kHz" duration="200 ms" tail="yes" volume="60 m3"/>')), DONE)
        with h5(folder / "c.h5") as f:
            responses.append(f["responses/pressure"][:].tobytes())
    assert responses[0] == responses[1]


def test_odd_places_and_input(folder, shared):
    """Stations on walls, rims and in corners give finite fields; what cannot be is refused with the line and what was expected."""
    for place in ('x="0 m" y="0 m" z="0 m"', 'x="1 m" y="4 m" z="2 m"', 'x="1 m" y="4 m" z="3 m"', 'x="5 m" y="4 m" z="3 m"',
                  'x="5 m" y="4 m" z="0 m"', 'x="-20 m" y="-20 m" z="0 m"', 'x="-3 m" y="0 m" z="2 m"'):
        for more in "", '<solver diffraction="btm"/>':
            (folder / "scene.obj").write_text(SCENE)
            text = CONFIG.replace("MATERIAL", 'rigid="yes"').replace('x="2 m" y="-1 m" z="1.5 m"', place)
            text = text.replace('<paths reflections="1"/>', f'<paths reflections="1" diffractions="1"/>{more}')
            (folder / "c.xml").write_text(text)
            expect(keller("run", "c.xml", "-o", "c.h5", "--force", cwd=folder), DONE)
            with h5(folder / "c.h5") as f:
                for name in "paths/gain", "responses/pressure":
                    assert all(map(math.isfinite, f[name][:].view("f8" if name == "paths/gain" else "f4").ravel())), (place, more, name)
    for change, expected in (
            (("<frequency>250 Hz", "<frequency>0 Hz"), ("c.xml:4", "0 Hz")),
            (("<frequency>250 Hz", "<frequency>1 THz"), ("c.xml:4", "from 1 Hz to 1 MHz")),
            (('speed="340 m/s"', 'speed="0 m/s"'), ("c.xml:6", "expected 1 m/s")),
            (('speed="340 m/s" absorption="none"', 'temperature="-300 degC"'), ("c.xml:6", "-20 degC to 50 degC")),
            (('speed="340 m/s" absorption="none"', 'humidity="130 %"'), ("c.xml:6", "0 % to 100 %")),
            (('duration="100 ms"', 'duration="61 s"'), ("c.xml:14", "1 ms to 60 s")),
            (('rate="32 kHz"', 'rate="500 kHz"'), ("c.xml:14", "384 kHz"))):
        expect(run(folder, change=change), BAD_INPUT, *expected)
    # bands beyond half the sampling rate are no harm: they are not in the response
    expect(run(folder, change=('rate="32 kHz"', 'rate="1 kHz"')), DONE)


def test_domains_do_not_mix(folder, shared):
    expect(run(folder, 'itu="concrete"'), BAD_INPUT, "c.xml:7", "itu", 'domain "rf"')
    # a scene that brings materials of its own
    (folder / "room.xml").write_text(
        '<scene version="2.1.0"><bsdf type="diffuse" id="itu_concrete"/><shape type="ply" id="floor"><string name="filename" '
        'value="floor.ply"/><ref id="itu_concrete"/></shape></scene>')
    (folder / "floor.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                                      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    expect(run(folder, 'rigid="yes"', change=("scene.obj", "room.xml")), BAD_INPUT, "c.xml:", "says what it does to radio waves",
           "domain is acoustic")
    expect(run(folder, 'rigid="yes"', change=('<paths reflections="1"/>', '<paths diffractions="2"/><solver diffraction="btm"/>')),
           BAD_INPUT, "c.xml:", "one edge on a path")
    expect(run(folder, 'absorption="0.1"', change=('<paths reflections="1"/>', '<paths diffractions="1"/><solver diffraction="btm"/>')),
           BAD_INPUT, "c.xml:", "rigid wedges")


def test_shipped_configurations_run(folder, shared):
    for name in ("shoebox", "hall", "noise_barrier", "corridor"):
        config = SOURCE / "configs" / f"{name}.xml"
        expect(keller("check", config), DONE)
        done = expect(keller("run", config, "-q", "-o", f"{name}.h5", cwd=folder), DONE)
        assert "strongest path" in done.stdout
        with h5(folder / f"{name}.h5") as f:
            assert f["paths/gain"].shape[0] > 10
            if name != "noise_barrier":
                assert f["responses/pressure"].shape[0] == 2
    # behind the barrier it is quieter by what barriers do
    with h5(folder / "noise_barrier.h5") as f:
        y, x = list(f["coverage/ear/y"]), list(f["coverage/ear/x"])
        level = f["coverage/ear/level_a"][1]
        before, behind = level[y.index(-12), x.index(0)], level[y.index(12), x.index(0)]
        assert 15 < before - behind < 35, before - behind
    done = subprocess.run([sys.executable, SOURCE / "examples" / "room_acoustics.py", folder / "hall.h5"], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0 and "brass to strings" in done.stdout and "t30/s" in done.stdout, done.stderr


def test_levels_are_drawn(folder, shared):
    need_gnuplot()
    expect(run(folder), DONE)
    for more in [], ["--frequency", "2"], ["--tx", "s"]:
        expect(keller("plot", "c.h5", "--what", "level", *more, "-o", "l.png", "--force", cwd=folder), DONE)
        assert min(png_size(folder / "l.png")) > 100
    for what in "coverage", "delay", "paths":
        expect(keller("plot", "c.h5", "--what", what, "-o", f"{what}.png", cwd=folder), DONE)


if __name__ == "__main__":
    sys.exit(main(globals()))
