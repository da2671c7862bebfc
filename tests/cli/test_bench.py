"""keller bench: the measurements behind docs/ run, print what they say they print, and leave nothing behind. Speaks TAP."""
import csv
import os
import signal
import subprocess
import sys
import time

sys.dont_write_bytecode = True
from test_program import DONE, FAILED, PROGRAM, USAGE, expect, keller, main, names


def test_bench_prints_its_table(folder, shared):
    rows = expect(keller("bench", "cone", "--csv", "--cases", "2000", "--test", "edge", cwd=folder), DONE).stdout.split()
    head = "test,half_angle_deg,eccentricity,cases,false_negative,false_positive,max_range_error_eps,ns_per_call"
    assert rows[0] == head + ",ns_per_call_scalar" and len(rows) == 1 + 10 * 3 + 1
    assert rows[-1].startswith("edge,all,all,2000,0,")
    assert sum(int(row.split(",")[3]) for row in rows[1:-1]) == 2000
    done = keller("bench", "cone", "--cases", "many", cwd=folder)
    assert done.returncode == USAGE and "many" in done.stderr


def test_bench_accuracy(folder, shared):
    # without tables of exact fields it says so, first of all, and goes on with what is computed: not waited for here
    run = subprocess.Popen([PROGRAM, "bench", "accuracy", "--csv", "--truth", "nowhere"], stdout=subprocess.DEVNULL,
                           stderr=subprocess.PIPE, text=True)
    told = run.stderr.readline()
    run.kill()
    run.communicate()
    assert "nowhere" in told and "--truth FOLDER" in told, told
    # 3 wedges, 3 materials, 2 polarisations, 3 models; a cut of the tables: for a plane wave at a half-plane the theory is exact
    truth = os.path.join(os.environ["KELLER_SOURCE"], "tests", "truth")
    done = expect(keller("bench", "accuracy", "--csv", "--truth", truth, "--curves", ".", cwd=folder), DONE)
    rows = [row.split(",") for row in done.stdout.split("\n")[:-1]]
    assert rows[0] == "part,wedge,case,polarization,k,points,max_dB,rms_dB,level_dB,theory_dB".split(",")
    parts = [row[0] for row in rows[1:]]
    assert [part for part in parts if part in ("lossy", "boundary")] == ["lossy"] * (3 * 3 * 2 * 3) + ["boundary"] * 15
    assert all(float(row[8]) < 1 for row in rows[1:] if row[0] == "lossy" and row[2].endswith(" reciprocal"))
    exact = [float(row[6]) for row in rows if row[:3] == ["conductor", "half-plane", "plane"]]
    assert len(exact) == 6 and max(exact) < -240
    assert parts.count("conductor") == 28
    assert {"accuracy-lossy.csv", "accuracy-edges.csv", "accuracy-field-90.csv"} <= set(names(folder))
    assert keller("bench", "accuracy", "--truth", cwd=folder).returncode == USAGE
    done = expect(keller("bench", "accuracy", "--csv", "--transition", cwd=folder), DONE)
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert len(rows) == 15 and all(float(row["difference"]) < 2e-14 and float(row["keller_ns"]) > 0 for row in rows), rows


def test_bench_of_paths(folder, shared):
    """Each combination is a run; counts are the same whatever the threads; nothing is left behind."""
    done = expect(keller("bench", "paths", "--csv", "--city", "300", "--receivers", "3", "--cells", "16", "--orders", "1,1,1",
                         "--threads", "1", "--threads", "2", cwd=folder, env={**os.environ, "TMPDIR": str(folder)}), DONE)
    rows = list(csv.DictReader(done.stdout.splitlines()))
    assert [(row["receivers"], row["kind"], row["threads"]) for row in rows] == [
        ("3", "points", "1"), ("3", "points", "2"), ("16", "cells", "1"), ("16", "cells", "2")]
    assert rows[0]["paths"] == rows[1]["paths"] and rows[2]["paths"] == rows[3]["paths"] > "0" and float(rows[0]["peak_mb"]) > 1
    assert names(folder) == []
    for wrong in [["--orders", "1,0"], ["--receivers", "0"], ["--threads"], ["--nothing", "1"]]:
        done = keller("bench", "paths", *wrong, cwd=folder)
        assert done.returncode == USAGE and wrong[0] in done.stderr, done


def test_bench_of_paths_keeps_its_files_where_asked(folder, shared):
    for again in range(2):      # the folder is made, or is there
        expect(keller("bench", "paths", "--city", "300", "--receivers", "1", "--orders", "0,0,0", "--keep", "kept", cwd=folder,
                      env={**os.environ, "TMPDIR": str(shared)}), DONE)
        assert names(folder) == ["kept"] and names(folder / "kept") == ["city.obj", "places.csv", "run.h5", "run.xml"]
    for keep in "kept/run.h5", "none/kept":
        done = keller("bench", "paths", "--keep", keep, cwd=folder)
        assert done.returncode == FAILED and f"{keep}: " in done.stderr, done


def test_bench_of_paths_is_ended_and_leaves_nothing(folder, shared):
    """By the time limit, in a city's making and in a run; by signals, while a program of it runs."""
    here = {**os.environ, "TMPDIR": str(folder)}
    done = keller("bench", "paths", "--city", "1e7", "--limit", "1", env=here)
    assert done.returncode == FAILED and "10000000 triangles" in done.stderr and "--limit" in done.stderr, done
    assert names(folder) == []
    many = ["bench", "paths", "--csv", "--city", "3000", "--cells", "1e6", "--orders", "3,1,3"]
    done = expect(keller(*many, "--limit", "1", env=here), DONE)
    assert ",>1," in done.stdout and names(folder) == []
    for number in [signal.SIGINT, signal.SIGTERM]:
        bench = subprocess.Popen([PROGRAM, *many], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=here)
        deadline = time.monotonic() + 60
        while not list(folder.glob("*/run.xml")) and bench.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
        bench.send_signal(number)
        _, error = bench.communicate(timeout=60)
        assert bench.returncode == FAILED and "interrupted" in error, (bench.returncode, error)
        assert names(folder) == []


def test_bench_of_next_hits_loses_none(folder, shared):
    rows = expect(keller("bench", "nexthit", "--csv", "--layers", "12", "--rays", "200", "--half-angle", "1", cwd=folder), DONE)
    head, *rows = [row.split(",") for row in rows.stdout.split()]
    assert head == ["scene", "query", "method", "structure", "max_hits", "us_per_ray", "hits_per_ray", "lost", "doubled", "nodes",
                    "triangles"]
    assert len(rows) == 3 * 2 * 4 * 4  # queries, structures, methods, numbers of hits
    assert all(row[0] == "layers-12" and row[7:9] == ["0", "0"] and float(row[5]) > 0 for row in rows)
    for query in "random", "through", "cone":
        for most in "1", "5", "15", "0":
            hits = {row[6] for row in rows if row[1] == query and row[4] == most}
            assert len(hits) == 1 and (most == "0" or 0 < float(*hits) <= int(most))
    done = keller("bench", "nexthit", "--layers", "none", cwd=folder)
    assert done.returncode == USAGE and "none" in done.stderr


if __name__ == "__main__":
    sys.exit(main(globals()))
