"""Turns data files into one C file: for each input a byte array and its length, so that the program needs no data folder.

usage: embed.py OUTPUT.c INPUT..."""
import pathlib
import re
import sys

lines = ['#include "base/embedded.h"', '']
for name in sys.argv[2:]:
    path = pathlib.Path(name)
    symbol = "keller_data_" + re.sub(r"\W", "_", path.name)
    data = path.read_bytes() + b"\0"
    lines.append(f"const char {symbol}[] = {{")
    for i in range(0, len(data), 24):
        lines.append("    " + ", ".join(str(b if b < 128 else b - 256) for b in data[i:i + 24]) + ",")
    lines += ["};", f"const unsigned long {symbol}_length = {len(data) - 1};", ""]
pathlib.Path(sys.argv[1]).write_text("\n".join(lines))
