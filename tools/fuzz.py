"""Builds the fuzz targets in a folder configured with -Dfuzz=true and runs each for some seconds.

usage: fuzz.py BUILD_FOLDER [--seconds S] [--jobs N]

The targets are the executables of tests/fuzz/meson.build. fuzz_NAME uses the dictionary tests/fuzz/NAME.dict and the seeds in
tests/fuzz/corpus/NAME where there are any. What the fuzzer finds new is kept for the next run in BUILD_FOLDER/corpus, inputs
that broke something in BUILD_FOLDER/crashes."""
import argparse
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
MESON = os.environ.get("MESON", "meson")


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    targets = json.loads(subprocess.check_output([MESON, "introspect", "--targets", arguments.folder]))
    here = str(ROOT / "tests" / "fuzz" / "meson.build")
    programs = sorted(t["filename"][0] for t in targets if t["type"] == "executable" and t["defined_in"] == here)
    if not programs:
        sys.exit("fuzz: no target found; expected executables in tests/fuzz/meson.build")
    ninja = ["ninja", "--quiet", "-C", arguments.folder, "-j", str(arguments.jobs)]
    if subprocess.run(ninja + [os.path.relpath(program, arguments.folder) for program in programs]).returncode:
        sys.exit("fuzz: the targets do not build")
    crashes = arguments.folder / "crashes"
    crashes.mkdir(exist_ok=True)
    failed = []
    for program in programs:
        name = pathlib.Path(program).name
        sources = ROOT / "tests" / "fuzz"
        seeds, words = sources / "corpus" / name.replace("fuzz_", ""), sources / (name.replace("fuzz_", "") + ".dict")
        corpus = arguments.folder / "corpus" / name
        corpus.mkdir(parents=True, exist_ok=True)
        print(f"== {name}, {arguments.seconds} s", flush=True)
        command = [program, corpus] + ([seeds] if seeds.is_dir() else []) + ([f"-dict={words}"] if words.exists() else [])
        command += [f"-max_total_time={arguments.seconds}", "-timeout=10", "-rss_limit_mb=2048", "-print_final_stats=1",
                    "-verbosity=0", f"-artifact_prefix={crashes}/{name}-"]
        if subprocess.run(command).returncode:
            failed.append(name)
    print(f"fuzz: {len(programs) - len(failed)} targets without a finding, {len(failed)} with one"
          + (f" ({', '.join(failed)}; inputs in {crashes})" if failed else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
