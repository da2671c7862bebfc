"""Prints what ISO 3382-1 reads from the impulse responses of a result: python3 room_acoustics.py RESULT.h5"""
import sys

import h5py

with h5py.File(sys.argv[1]) as f:
    r = f["responses"]
    transmitters, receivers = f["transmitters/id"].asstr()[:], f["receivers/id"].asstr()[:]
    for row, (tx, rx) in enumerate(zip(r["tx"], r["rx"])):
        print(f"{transmitters[tx]} to {receivers[rx]}, first arrival after {1e3 * r['arrival'][row]:.2f} ms")
        print("    octave/Hz" + "".join(f"{band:9.0f}" for band in r["bands"]))
        for name in ("edt", "t20", "t30", "c50", "c80", "d50", "g"):
            unit = r[name].attrs["units"]
            print(f"    {name + ('/' + unit if unit != '1' else ''):9s}" + "".join(f"{value:9.2f}" for value in r[name][row]))
