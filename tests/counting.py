"""That what `make test` counts is true: tests of tools/test.py and tests/tap.sh. Speaks TAP."""
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "tools"))
import test as runner  # noqa: E402


def count(result, stdout, tap=True):
    log = json.dumps({"name": "keller:slow / t", "result": result, "stdout": stdout}) + "\n"
    return str(runner.count_log(log, {"t"} if tap else set()))


def mended(script):
    done = subprocess.run([ROOT / "tests" / "tap.sh", "sh", "-c", script], stdout=subprocess.PIPE, text=True)
    return f"{done.stdout.strip()} [{done.returncode}]"


CASES = [
    ("cases are counted one by one", count("OK", "1..2\nok 1 - a\n# ok note\nok 2 - b\n"), "2 passed, 0 failed"),
    ("a failed case is counted once", count("FAIL", "1..2\nok 1 - a\nnot ok 2 - b\n"), "1 passed, 1 failed"),
    ("a crash after good cases is a failure", count("ERROR", "1..3\nok 1 - a\n"), "1 passed, 1 failed"),
    ("a time-out is a failure", count("TIMEOUT", ""), "0 passed, 1 failed"),
    ("a skipped case is neither passed nor failed", count("SKIP", "1..1\nok 1 # SKIP a\n"),
     "0 passed, 0 failed, 1 skipped"),
    ("a skipped case as cmocka writes it", count("OK", "1..2\nok 1 - a\nnot ok 2 # SKIP b\n"),
     "1 passed, 0 failed, 1 skipped"),
    ("a program may skip as a whole", count("SKIP", "1..0 # SKIP no scenes\n"), "0 passed, 0 failed, 1 skipped"),
    ("a TAP program that says nothing has failed", count("SKIP", ""), "0 passed, 1 failed"),
    ("a program without TAP is one case", count("OK", "ok then\nok\n", tap=False), "1 passed, 0 failed"),
    ("a failed program without TAP is one failure", count("FAIL", "", tap=False), "0 passed, 1 failed"),
    ("a failed case is shown with its notes",
     runner.failures("ok 1 - a\n# fine\nnot ok 2 - b\n# 1 != 2\nnoise\n# more\nnot ok 3 # SKIP c\nok 4 - d\n"),
     ["not ok 2 - b", "# 1 != 2"]),
    ("tap.sh mends cmocka's skip", mended("echo 'not ok 2 # SKIP b'"), "ok 2 # SKIP b [0]"),
    ("tap.sh leaves a failure alone", mended("echo 'not ok 2 - b # SKIP'; exit 3"), "not ok 2 - b # SKIP [3]"),
    ("tap.sh hands on a death by signal", mended("echo ok 1; kill -s ABRT $$"), "ok 1 [134]"),
]

print(f"1..{len(CASES)}")
for number, (name, found, expected) in enumerate(CASES, 1):
    print(f"{'ok' if found == expected else 'not ok'} {number} - {name}")
    if found != expected:
        print(f"# found {found}; expected {expected}")
sys.exit(any(found != expected for _, found, expected in CASES))
