"""What must not change the paths in cities: tools/invariance.py runs the program on small ones. Speaks TAP."""
import sys

sys.dont_write_bytecode = True
from test_program import DONE, PROGRAM, SOURCE, Skip, expect, keller, main

sys.path.append(str(SOURCE / "tools"))
try:
    import invariance
except ImportError as problem:      # h5py or numpy
    invariance, reason = None, problem

ORDERS = {"reflections": 2, "diffractions": 1, "transmissions": 0, "interactions": 3}
STREET, CROSSING, COURT = (58.4, 5.1, 1.5), (-40.3, 6.7, 10.2), (-39.2, 44.6, 1.5)


def city(folder, layout, blocks, transmitter, receivers, **orders):
    if invariance is None:
        raise Skip(reason)
    expect(keller("scene", "generate", "city", "--layout", layout, "--blocks", blocks, "-o", "city.obj", cwd=folder), DONE)
    return invariance.Runs(PROGRAM, folder / "city.obj", [transmitter], receivers, ORDERS | orders, folder)


def told(line):
    print("# " + line, flush=True)


def count(paths):
    return sum(len(of_pair) for of_pair in paths.values())


def test_blocks(folder, shared):
    base, wrong = invariance.hold(city(folder, "grid", 6, CROSSING, [STREET, COURT]), told)
    assert count(base) > 300 and len(base) == 2, count(base)
    assert wrong == 0, wrong


# From 1,500 triangles on cones are split down to the aperture; batches of cones, which split all, would take a minute.
def test_avenues_that_meet_in_a_star(folder, shared):
    runs = city(folder, "star", 16, (10.3, 4.7, 40.2), [(150.4, -5.1, 1.5)], interactions=2)
    cones = set()
    base, wrong = invariance.hold(runs, lambda line: (told(line), cones.add(runs.cones)), skip=["accelerator", "threads"])
    assert count(base) > 100, count(base)
    assert len(cones) > 3, f"apertures change nothing: {cones}"
    assert wrong == 0, wrong


def test_what_differs_is_told(folder, shared):
    runs = city(folder, "grid", 6, CROSSING, [STREET, COURT])
    base = runs.paths()
    runs.orders = ORDERS | {"interactions": 2}
    fewer = runs.paths()
    missing, extra, _, _ = invariance.compare(base, fewer)
    assert len(missing) == count(base) - count(fewer) > 0 and not extra, (len(missing), len(extra))
    missing, extra, _, _ = invariance.compare(fewer, base)
    assert len(extra) == count(base) - count(fewer) and not missing, (len(missing), len(extra))
    kinds, places, length = fewer[0, 0][-1]
    for moved in [(kinds, places + 2e-6, length), (kinds, places, length * (1 + 2e-9))]:
        other = {pair: list(paths) for pair, paths in fewer.items()}
        other[0, 0][-1] = moved
        missing, extra, _, _ = invariance.compare(fewer, other)
        assert len(missing) == len(extra) == 1, (len(missing), len(extra))


if __name__ == "__main__":
    sys.exit(main(globals()))
