"""Mutants of G-code through the check, on its own and against a design; writes bench/results/gcode_fuzz.json.

    python bench/gcode_fuzz.py [MUTANTS]

A mutant has bytes, digits, words or lines changed, doubled, moved or left out, or comes cut or with noise. The check
must read it or refuse it in one sentence: any other exception is a fault, printed with the mutant's number, from which
the same mutant can be made again (tests/slicers/mutants.py).
"""

import json
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "slicers"))

from mutants import base, mutant, outcome  # noqa: E402


def main(count: int) -> None:
    """Run the mutants and write what became of them."""
    text, found, faults, slowest = base(), Counter[str](), [], 0.0
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            before = time.process_time()
            try:
                found[outcome(mutant(text, number), Path(folder) / "mutant.gcode")] += 1
            except Exception:
                faults.append(number)
                print(f"mutant {number}: {traceback.format_exc(limit=-3)}")
            slowest = max(slowest, time.process_time() - before)
    mean_ms = 1e3 * (time.process_time() - start) / count
    result = {"mutants": count, **found, "tracebacks": len(faults), "mean_ms": mean_ms, "slowest_s": slowest}
    (HERE / "results" / "gcode_fuzz.json").write_text(json.dumps(result, indent=2) + "\n")
    print(result)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
