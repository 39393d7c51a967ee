"""Damaged files of every kind to every reader: ``python fuzz.py [--count N] [--seed N] [KIND ...]``.

Each file may be read, or refused with a message of ours, in 2 GB of addresses and half a minute of processor; anything
else is a fault. A fault ends the process, and another one goes on after it.
"""

import argparse
import json
import multiprocessing
import os
import random
import re
import resource
import runpy
import signal
import sys
import tempfile
import traceback
from collections import Counter
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import damage

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
ADDRESSES, SECONDS = 2 << 30, 30


def command(*words):
    """Reader that is a command; what it prints must not reach the terminal's control."""
    from sensorgen.cli import cli

    def read(file):
        import click

        out = StringIO()
        try:
            with redirect_stdout(out), redirect_stderr(out):
                cli.main([str(file) if word is None else str(word) for word in words], standalone_mode=False)
        except click.ClickException:
            pass
        assert "\x1b" not in out.getvalue()

    return read


@contextmanager
def told(name=""):
    """Refusals that are one line, which names the file."""
    from sensorgen.core.errors import SensorgenError

    try:
        yield
    except SensorgenError as error:
        words = str(error)
        assert name in words, words
        assert len(words) < 1000, words
        assert "\n" not in words, words
        raise


def recordings(folder):
    """Recordings and a log of the rig, and their readers by kind."""
    sys.path.insert(0, str(ROOT / "tests/recording"))
    import h5py
    import made
    import numpy as np
    import scipy.io as sio

    from sensorgen.measure.recording import parts, rig

    run = made.run(made.presses(2))
    z, t, tones = run.impedance_ohm[:1500, :2], run.time_s[:1500], made.TONES_HZ[:2]
    tree = made.tree([z], [t], made.stamps(t), (tones,))
    for name, packed in (("mat", False), ("packed", True)):
        sio.savemat(folder / f"whole.{name}", tree, do_compression=packed, appendmat=False)
    with h5py.File(folder / "whole.hdf5", "w") as file:
        file["impedance_data/lockin1"], file["impedance_time"] = z, t
        file.create_group("settings").attrs.update(dem_freqs=tones, version="V9", bandwidth=10.0)
    rows = [f"{a:.5f},{a + made.EPOCH_S:.4f},{b[0].real:.6g},{b[0].imag:.6g}" for a, b in zip(t, z, strict=True)]
    (folder / "whole.csv").write_text("time_s,stamp_s,re_ohm_1kHz,im_ohm_1kHz\n" + "\n".join(rows) + "\n")
    made.write_rig(folder / "whole.rig", [c[:300] for c in made.rig_rows(made.presses(2))])

    def recording(file):
        with told(file.name):
            for one in (one for lockins in parts(file) for one in lockins):
                assert (np.diff(one.time_s) > 0).all()
                assert one.impedance_ohm.shape == (len(one.time_s), len(one.tones_hz))
        command("bench", "show", None)(file)

    def of_rig(file):
        with told(file.name):
            log = rig(file)
            assert len(log.time_s) == len(log.error)
        command("bench", "show", folder / "whole.csv", "--rig", None)(file)

    return dict.fromkeys(("mat", "packed", "hdf5", "csv"), (recording, "")) | {"rig": (of_rig, "")}


BATCH = {
    "batch": "26",
    "specimens": {
        "26 triX .1mm": {"design": "trix-d0.1", "design_id": "0" * 16, "expected": {"capacitance_f": {"lower": 1e-11}}},
        "26 triX .1mm 2": {"design": "trix-d0.1", "design_id": "0" * 16, "expected": {}},
    },
}


def logged(folder):
    """Tables, a print bed, exports and a log, and their readers by kind; a refused file leaves a log as it was."""
    from sensorgen.core.errors import SensorgenError
    from sensorgen.measure.log import Log, exchange, verify

    rows = exchange.thesis_readings()[:12]
    with Log(folder / "whole.db", create=True) as log:
        log.add(rows)
        for kind in ("csv", "parquet"):
            exchange.export(log, folder / f"export.{kind}")
    (folder / "export.csv").rename(folder / "whole.table")
    (folder / "export.parquet").rename(folder / "whole.parquet")
    words = "\n".join(f"{r.written},{r.y_words},{r.z_words},{r.remark}" for r in rows)
    (folder / "whole.words").write_text(f"Design,Resistance in Y,Resistance in Z,Remarks\n{words}\n", "utf-8")
    (folder / "whole.batch").write_text(json.dumps(BATCH), "utf-8")

    def take(file):
        with Log(folder / "log.db", create=True) as log:
            before = log.head()
            try:
                with told():
                    exchange.import_file(log, file, {})
            except SensorgenError:
                assert log.head() == before
                raise

    def read(file):
        for left in ("-wal", "-shm"):
            Path(f"{file}{left}").unlink(missing_ok=True)
        with told(), Log(file) as log:
            log.readings(last=40)
            if faults := list(verify.faults(log)):
                raise SensorgenError(faults[0])

    suffixes = {"table": "", "words": "", "parquet": ".parquet", "batch": ".json"}
    return {kind: (take, suffix) for kind, suffix in suffixes.items()} | {"db": (read, ".db")}


def samples(folder):
    """Whole files by kind, with their readers."""
    from sensorgen.design import packs, printer
    from sensorgen.measure.readings import readings
    from sensorgen.workflows import api
    from sensorgen.workflows.batch import plan

    sys.path.insert(0, str(ROOT / "tests/gcode"))
    import good

    readers = recordings(folder) | logged(folder)
    (folder / "whole.invert").write_bytes((folder / "whole.csv").read_bytes())
    (folder / "whole.gcode").write_text(good.MAKER)
    for kind, name in (("printer", "printers/diabase-h5"), ("quality", "qualities/fine")):
        (folder / f"whole.{kind}").write_bytes((packs.profiles() / f"{name}.yaml").read_bytes())
    (folder / "whole.design").write_bytes((ROOT / "designs/23/sqxy-d0.1.yaml").read_bytes())
    (folder / "whole.plan").write_text(runpy.run_path(str(ROOT / "tests/batch/conftest.py"))["SMALL"])

    def table(file):
        with readings(str(file)) as source:
            list(source.blocks())

    def design(file):
        _ = api.load(file).printed

    return readers | {
        "invert": (table, ""), "gcode": (command("gcode", "check", None), ".gcode"),
        "printer": (lambda file: printer.load_printer(str(file)), ".yaml"),
        "quality": (lambda file: printer.load_quality(str(file)), ".yaml"), "plan": (plan.load, ".yaml"),
        "design": (design, ".yaml"),
    }  # fmt: skip


def outcome(read, file):
    """What came of a file: "read", a message's kind, or a fault."""
    from sensorgen.core.errors import SensorgenError

    try:
        signal.alarm(SECONDS)
        read(file)
        return "read", ""
    except SensorgenError:
        return "refused", ""
    except MemoryError:
        return "fault", "MemoryError\n" + traceback.format_exc()
    except BaseException:  # also SystemExit and the alarm
        return "fault", traceback.format_exc()
    finally:
        signal.alarm(0)


def late(*_):
    raise TimeoutError(f"more than {SECONDS} s")


def work(jobs, seed, folder, results):
    """Files by kind and number, one after the other, each with its place in ``jobs``."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    signal.signal(signal.SIGALRM, late)
    folder = Path(folder)
    os.chdir(folder)
    readers = samples(folder)
    contents = {kind: (folder / f"whole.{kind}").read_bytes() for kind, _ in jobs}
    for kind, content in contents.items():
        read, suffix = readers[kind]
        (folder / f"whole{suffix}").write_bytes(content)
        read(folder / f"whole{suffix}")
    for place, (kind, number) in enumerate(jobs):
        results.put((place, "begun", ""))
        read, suffix = readers[kind]
        file = folder / f"damaged{number}{suffix}"
        file.write_bytes(damage.mutated(contents[kind], random.Random(f"{seed} {kind} {number}")))
        results.put((place, *outcome(read, file)))
        file.unlink()
    status = Path("/proc/self/status")  # getrusage counts the parent's memory too
    peak = int(re.search(r"VmHWM:\s+(\d+)", status.read_text(encoding="utf-8"))[1]) >> 10 if status.exists() else 0
    results.put((-1, "peak", str(peak)))


KINDS = (
    "mat", "packed", "hdf5", "csv", "rig", "table", "words", "parquet", "batch", "db", "invert", "gcode", "printer",
    "quality", "plan", "design",
)  # fmt: skip


def fuzz(jobs, seed):
    """Number of files by kind and what came of them, the faults, and the largest memory [MB]."""
    spawn, peak, begin = multiprocessing.get_context("spawn"), 0, 0
    found = {kind: Counter() for kind, _ in jobs}
    faults = {kind: [] for kind in found}
    while begin < len(jobs):
        with tempfile.TemporaryDirectory() as folder:
            results, left, first = spawn.SimpleQueue(), jobs[begin:], begin
            process = spawn.Process(target=work, args=(left, seed, folder, results))
            process.start()
            while process.is_alive() or not results.empty():
                if not results.empty():
                    place, what, said = results.get()
                    kind, number = left[place]
                    if what == "peak":
                        peak = max(peak, int(said))
                    elif what == "begun":
                        begin = first + place + 1
                    else:
                        found[kind][what] += 1
                        faults[kind] += [f"{kind} {number}: {said}"] if what == "fault" else []
                else:
                    process.join(0.01)
        if process.exitcode:
            kind, number = jobs[begin - 1]
            found[kind]["fault"] += 1
            faults[kind].append(f"{kind} {number}: the process ended with {process.exitcode}")
    return {kind: {"kind": kind, **found[kind], "resident_mb": peak, "faults": faults[kind]} for kind in found}


def main():
    """Print a line of JSON for each kind; exit code 1 with faults."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("kinds", nargs="*", default=KINDS)
    options.add_argument("--count", type=int, default=10_000)
    options.add_argument("--seed", type=int, default=15)
    given = options.parse_args()
    bad = False
    for kind in given.kinds or KINDS:
        result = fuzz([(kind, number) for number in range(given.count)], given.seed)[kind]
        bad |= bool(result["faults"])
        print(json.dumps(result), flush=True)
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
