#!/usr/bin/env python3
"""Lists the paths of a result: read_paths.py RESULT.h5"""
import sys
import h5py
import numpy as np

with h5py.File(sys.argv[1], "r") as f:
    tx, rx = f["transmitters/id"].asstr()[()], f["receivers/id"].asstr()[()]
    offset, kind = f["paths/offset"][()], f["interactions/kind"][()]
    gain = 20 * np.log10(np.abs(f["paths/gain"][:, 0]) + 1e-300)   # complex c16[P,F]; the first frequency
    for p, (t, r, delay) in enumerate(zip(f["paths/tx"][()], f["paths/rx"][()], f["paths/delay"][()])):
        sequence = "".join("RDTS"[k] for k in kind[offset[p]:offset[p + 1]]) or "LOS"
        print(f"{tx[t]} -> {rx[r]}: {sequence}, {delay * 1e9:.3f} ns, {gain[p]:.2f} dB")
