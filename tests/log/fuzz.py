"""Files that were tampered with, as tables, print beds, exports and logs: ``python fuzz.py FOLDER FILES SEED``.

Each may be taken or refused with a message of ours; anything else is a fault, and so is a log that a refused file has
changed. Prints what came of them as JSON.
"""

import json
import random
import sys
from collections import Counter
from pathlib import Path

from sensorgen.core.errors import SensorgenError
from sensorgen.measure.log import Log, exchange, verify
from sensorgen.measure.log.entries import ROWS
from sensorgen.measure.log.exchange import thesis_readings

sys.path.insert(0, str(Path(__file__).parents[1] / "attacks"))
import damage

BATCH = {
    "batch": "26",
    "specimens": {
        "26 triX .1mm": {"design": "trix-d0.1", "design_id": "0" * 16, "expected": {"capacitance_f": {"lower": 1e-11}}},
        "26 triX .1mm 2": {"design": "trix-d0.1", "design_id": "0" * 16, "expected": {}},
    },
}


def samples(folder):
    """Sound files of every kind, by name."""
    rows = thesis_readings()[:12]
    with Log(folder / "sound.db", create=True) as log:
        log.add(rows)
        for name in ("table.csv", "table.parquet"):
            exchange.export(log, folder / name)
    words = "\n".join(f"{r.written},{r.y_words},{r.z_words},{r.remark}" for r in rows)
    (folder / "words.csv").write_text(f"Design,Resistance in Y,Resistance in Z,Remarks\n{words}\n", "utf-8")
    (folder / "batch.json").write_text(json.dumps(BATCH), "utf-8")
    return {
        p.name: p.read_bytes() for p in sorted(folder.iterdir()) if p.suffix in (".db", ".csv", ".parquet", ".json")
    }


def state(log):
    """Everything in a log."""
    return [entry for kind in ROWS for entry in log.entries(kind, superseded=True)]


def read_through(path):
    """A log read as ``list`` and ``verify`` read it."""
    with Log(path) as log:
        faults = list(verify.faults(log))
        log.readings(last=40)
        if faults:
            raise SensorgenError(faults[0])


def main(folder, count, seed):
    """Tamper, import, look."""
    folder, rng, seen, faults = Path(folder), random.Random(seed), Counter(), []
    sound = samples(folder)
    with Log(folder / "log.db", create=True) as log:
        log.add(thesis_readings()[:3])
        before = state(log)
        for _ in range(count):
            name = rng.choice(sorted(sound))
            path = folder / f"odd{Path(name).suffix}"
            path.write_bytes(damage.mutated(sound[name], rng))
            for left in (folder / "odd.db-wal", folder / "odd.db-shm"):
                left.unlink(missing_ok=True)
            try:
                if path.suffix == ".db":
                    read_through(path)
                else:
                    exchange.import_file(log, path, {})
                seen[f"{name} taken"] += 1
                before = state(log)
            except SensorgenError as error:
                seen[f"{name} refused"] += 1
                if len(str(error)) > 1000 or "\n" in str(error):
                    faults.append(f"{name}: message of {len(str(error))} letters")
                if path.suffix != ".db" and rng.random() < 0.05 and state(log) != before:
                    faults.append(f"{name}: refused, and the log has changed")
            except Exception as error:  # that is what is looked for
                faults.append(f"{name}: {type(error).__name__}: {error}"[:300])
                (folder / f"fault{len(faults)}{path.suffix}").write_bytes(path.read_bytes())
        if state(log) != before:
            faults.append("the log has changed")
        faults += list(verify.faults(log))
    print(json.dumps({"files": count, **dict(sorted(seen.items())), "faults": faults[:20]}, indent=1))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
