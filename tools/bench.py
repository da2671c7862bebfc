"""Runs the measurements that bench/ registers with meson (`benchmark(...)`), one after the other, and shows their tables.

usage: bench.py BUILD_FOLDER"""
import json
import os
import subprocess
import sys

MESON = os.environ.get("MESON", "meson")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = sys.argv[1]
    suites = json.loads(subprocess.check_output([MESON, "introspect", "--benchmarks", folder]))
    if not suites:
        print("bench: this version has no measurements yet: bench/ registers none")
        return 0
    print("bench: " + ", ".join(suite["name"] for suite in suites), flush=True)
    return subprocess.run([MESON, "test", "-C", folder, "--benchmark", "--no-rebuild", "--verbose"]).returncode


if __name__ == "__main__":
    sys.exit(main())
