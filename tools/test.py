"""Builds keller and runs its tests; the last line says `N passed, N failed` (and `, N skipped` where some were).

usage: test.py [--jobs N] BUILD[:SETUP]...

Each BUILD is made by `make build-BUILD` in build/BUILD and counts as one case; then `meson test` runs there (with the test
setup SETUP, if given, of tests/meson.build), and each case that a test reports in TAP counts. The exit status is 0
only if nothing failed and something passed."""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
MESON = os.environ.get("MESON", "meson")
CASE = re.compile(r"(not )?ok\b\s*\d*[^#]*(#\s*skip)?", re.IGNORECASE)
SKIP_ALL = re.compile(r"1\.\.0\b\s*#\s*skip", re.IGNORECASE)


class Count:
    def __init__(self, passed=0, failed=0, skipped=0):
        self.passed, self.failed, self.skipped = passed, failed, skipped

    def add(self, other):
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped

    def __str__(self):
        return f"{self.passed} passed, {self.failed} failed" + (f", {self.skipped} skipped" if self.skipped else "")


def count_test(result, tap, stdout):
    """The cases of one test program: `result` is meson's word for the whole of it. A program that failed counts at least
    one failure, however many of its cases were fine before it crashed, and one that speaks TAP but reports nothing has
    failed (meson calls it skipped)."""
    count = Count()
    for line in stdout.splitlines() if tap else []:
        match = CASE.match(line)
        if not match:
            continue
        if match.group(2):
            count.skipped += 1
        elif match.group(1):
            count.failed += 1
        else:
            count.passed += 1
    silent = not (count.passed or count.failed or count.skipped)
    if result in ("OK", "EXPECTEDFAIL"):
        count.passed += silent
    elif result == "SKIP":
        if silent and tap and not SKIP_ALL.search(stdout):
            count.failed += 1
        else:
            count.skipped += silent
    elif not count.failed:
        count.failed += 1
    return count


def count_log(log, tap_names):
    """The cases in meson's testlog.json: one JSON object a line."""
    total = Count()
    for line in log.splitlines():
        test = json.loads(line)
        name = test["name"].split(" / ")[-1]
        total.add(count_test(test["result"], name in tap_names, test.get("stdout") or ""))
    return total


def failures(stdout):
    """The failed cases of a program with the notes that follow them, which meson keeps to its log."""
    lines, shown = [], False
    for line in stdout.splitlines():
        match = CASE.match(line)
        if match or not line.startswith("#"):
            shown = bool(match and match.group(1) and not match.group(2))
        if shown:
            lines.append(line)
    return lines


def run_build(build, setup, jobs):
    """Makes one build and runs its tests."""
    folder = ROOT / "build" / build
    print(f"== {build}: build", flush=True)
    if subprocess.run(["make", "--no-print-directory", f"build-{build}", f"JOBS={jobs}"], cwd=ROOT).returncode:
        print(f"== {build}: the build failed (counted as one failure); none of its tests ran", flush=True)
        return Count(failed=1)
    tests = json.loads(subprocess.check_output([MESON, "introspect", "--tests", folder]))
    for log in (folder / "meson-logs").glob("testlog*.json"):
        log.unlink()
    print(f"== {build}: tests", flush=True)
    command = [MESON, "test", "-C", folder, "--no-rebuild", "--print-errorlogs", "--num-processes", str(jobs)]
    status = subprocess.run(command + (["--setup", setup] if setup else []), cwd=ROOT).returncode
    total = Count(passed=1)
    logs = list((folder / "meson-logs").glob("testlog*.json"))  # one; its name holds the setup's
    for log in logs:
        text = log.read_text()
        total.add(count_log(text, {test["name"] for test in tests if test["protocol"] == "tap"}))
        for test in map(json.loads, text.splitlines()):
            for line in failures(test.get("stdout") or ""):
                print(f"{test['name']}: {line}")
    if tests and not logs:
        print(f"== {build}: meson ran no test (counted as one failure)")
        total.failed += 1
    if status and not total.failed:
        print(f"== {build}: meson test ended with status {status} (counted as one failure)")
        total.failed += 1
    return total


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("builds", nargs="+")
    arguments = parser.parse_args()
    total, summary = Count(), []
    for build, _, setup in (name.partition(":") for name in arguments.builds):
        count = run_build(build, setup, arguments.jobs)
        summary.append(f"{build}: {count} (the build is one of them)")
        total.add(count)
    print("\n" + "\n".join(summary))
    print(total, flush=True)
    return 1 if total.failed or not total.passed else 0


if __name__ == "__main__":
    sys.exit(main())
