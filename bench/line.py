"""Time per impedance of the line against its error, all methods in one run; writes bench/results/line.* and pictures.

Times are the processor's, one thread for each program: what a clock shows on an idle machine, and nearly that on a busy
one. Every round runs each method once; times are medians over the rounds, ratios medians of those within a round.
Errors are the largest over the 224 reference cases, 25 digits from 60-digit transfer matrices: they hold both of the
thesis's geometries at its seven tones, so a sample of the grid adds nothing.
"""

import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy is loaded

import mpmath
import numpy as np

HERE = Path(__file__).parent
RESULTS, PICTURES = HERE / "results", HERE.parent / "docs" / "pictures"
sys.path.insert(0, str(HERE.parent / "tests" / "models"))

import line_abcd  # noqa: E402
import line_closed  # noqa: E402
import line_ladder  # noqa: E402
from line_cases import PLATE, TONES, cases, exact, off  # noqa: E402

from sensorgen.core.errors import OutOfRange  # noqa: E402
from sensorgen.models import line  # noqa: E402
from sensorgen.solvers.line.inputs import PressedLine, read  # noqa: E402

ROUNDS = 7
Inputs = dict[str, Any]
Method = Callable[..., Any]
NGSPICE = shutil.which("ngspice")


def grid(forces: int = 61, positions: int = 101) -> Inputs:
    """Tones, forces and positions, each on its own axis."""
    axes = {"frequency_hz": np.array(TONES)[:, None, None], "force_n": np.linspace(0, 6, forces)[:, None]}
    return PLATE | axes | {"left_m": np.linspace(0, 0.09, positions)}


def triples(count: int) -> Inputs:
    """Force, position and tone of every sample by itself."""
    draw = np.random.default_rng(5)
    of = {"frequency_hz": draw.choice(TONES, count), "force_n": draw.uniform(0, 6, count)}
    return PLATE | of | {"left_m": draw.uniform(0, 0.09, count)}


def scikit_rf(**inputs: Any) -> Any:
    """One force and position, all tones in one call: three lines and an open end, against ports of 50 ohm."""
    import skrf

    tones = np.atleast_1d(inputs["frequency_hz"])
    frequency = skrf.Frequency.from_f(tones, unit="Hz")
    r, y, lengths = read(PressedLine(**inputs)).sections()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        media = [
            skrf.media.DefinedGammaZ0(frequency, z0_port=50, z0=np.sqrt(rs / ys), gamma=np.sqrt(rs * ys))
            for rs, ys in ((r[0], y[0]), (r[1], y[1]))
        ]
        left, patch, right = (media[k].line(float(length), "m") for k, length in zip((0, 1, 0), lengths, strict=True))
        s = (left**patch**right ** media[0].open()).s[:, 0, 0]
        return 50 * (1 + s) / (1 - s)


def ngspice(cells: int, **inputs: Any) -> Any:
    """One force and position as a circuit of three times so many cells, all tones in one run."""
    r, y, lengths = read(PressedLine(**inputs)).sections()
    tones = np.atleast_1d(inputs["frequency_hz"])
    lines, node = ["ladder", "I1 0 n0 AC 1", "Rdc n0 0 1e18"], 0
    for rs, ys, length in zip(r, y, lengths, strict=True):
        step = float(length) / cells if length > 1e-12 else 0.0  # what rounding leaves is no section to a circuit
        half = float(np.atleast_1d(ys.imag / (2 * np.pi * tones))[0]) * step / 2
        for _ in range(cells if step else 0):
            lines += [f"Ca{node} n{node} 0 {half:.17g}", f"R{node} n{node} n{node + 1} {rs * step:.17g}"]
            lines += [f"Cb{node} n{node + 1} 0 {half:.17g}"]
            node += 1
    runs = [line for f in tones for line in (f"ac lin 1 {f:.17g} {f:.17g}", "print v(n0)")]
    text = "\n".join([*lines, ".control", "set numdgt=15", *runs, ".endc", ".end", ""])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ladder.cir"
        file.write_text(text, "utf-8")
        done = subprocess.run([str(NGSPICE), "-b", str(file)], capture_output=True, text=True, check=False, cwd=folder)
    found = re.findall(r"v\(n0\) = ([-+.e\d]+),([-+.e\d]+)", done.stdout)
    if len(found) != len(tones):
        raise RuntimeError(done.stdout + done.stderr)
    return np.array([complex(float(re_), float(im)) for re_, im in found])


def one_by_one(method: Method, **inputs: Any) -> Any:
    """A method that takes one force and position with all their tones, over the reference cases."""
    keys = [k for k, v in inputs.items() if np.ndim(v) and k != "frequency_hz"]
    columns = np.broadcast_arrays(inputs["frequency_hz"], *(inputs[k] for k in keys))
    return np.array(
        [
            complex(method(**inputs | dict(zip(("frequency_hz", *keys), row, strict=True)))[0])
            for row in zip(*columns, strict=True)
        ]
    )


SPOT = PLATE | {"frequency_hz": np.array(TONES)}
SWEEP = PLATE | {"frequency_hz": np.geomspace(1e3, 1e5, 2000)}


def by_name(method: Method, **options: Any) -> Method:
    """A method of a line that takes the line's quantities by name."""
    return lambda **inputs: method(PressedLine(**inputs), **options)


def methods() -> Iterator[tuple[str, Method, Inputs, Method | None]]:
    """Name, what is timed, on which inputs, and what is held against the references where that differs."""
    per_call = partial(one_by_one, scikit_rf)
    yield "recursion, grid", by_name(line.impedance), grid(), None
    yield "recursion, 10^5 triples", by_name(line.impedance), triples(10**5), None
    yield "recursion, 10^6 triples", by_name(line.impedance), triples(10**6), None
    slopes = by_name(line.sensitivities, of=["force_n", "left_m"])
    yield "recursion with dZ/dF and dZ/dx, 10^5 triples", slopes, triples(10**5), by_name(line.impedance)
    yield "exponentials, corrected", by_name(line_closed.impedance), grid(), None
    yield "exponentials, B.48 as printed", by_name(line_closed.impedance, as_printed="B.48"), grid(), None
    yield "ABCD matrices", by_name(line_abcd.impedance), grid(), None
    for cells, size in ((10, 61), (100, 61), (1000, 21), (10_000, 11)):
        yield f"pi ladder, {cells}", by_name(line_ladder.impedance, cells=cells), grid(size, size), None
    for cells, size in ((10, 61), (100, 61), (1000, 21)):
        yield (
            f"one-sided ladder, {cells}",
            by_name(line_ladder.impedance, cells=cells, one_sided=True),
            grid(size, size),
            None,
        )
    yield "scikit-rf, 7 tones a call", scikit_rf, SPOT, per_call
    yield "scikit-rf, 2000 tones a call", scikit_rf, SWEEP, per_call
    if NGSPICE is None:
        print("ngspice is not installed: left out (scripts/system-packages --slicers installs it)")
        return
    for cells in (100, 1000):
        spice = partial(ngspice, cells)
        yield f"ngspice, {cells} cells", spice, SPOT, partial(one_by_one, spice)


def together() -> Iterator[tuple[Inputs, list[Any]]]:
    """The reference cases, those of one geometry as arrays, and their impedances with 25 digits."""
    known = cases()
    for width in {inputs["width_m"] for inputs, _ in known}:
        part = [(inputs, z) for inputs, z in known if inputs["width_m"] == width]
        columns = {k: np.array([inputs[k] for inputs, _ in part]) for k in ("frequency_hz", "force_n", "left_m")}
        with mpmath.workdps(40):
            yield part[0][0] | columns, [mpmath.mpc(*z) for _, z in part]


def errors(method: Method) -> tuple[float, float]:
    """Largest relative error of Z and of Re Z."""
    with np.errstate(all="ignore"):
        found = [off(z, true) for inputs, known in together() for z, true in zip(method(**inputs), known, strict=True)]
    whole, real = zip(*found, strict=True)
    return max(whole), max(real)


def processor() -> float:
    """Processor time of this process and of those that it waited for [s]."""
    started = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + started.ru_utime + started.ru_stime


def took(method: Method, inputs: Inputs) -> float:
    """Time per impedance [s], of as many calls as take a twentieth of a second."""
    calls, start = 0, processor()
    while not calls or processor() - start < 0.05:
        answer = method(**inputs)
        calls += 1
    return (processor() - start) / calls / np.size(answer[0] if isinstance(answer, tuple) else answer)


def measure() -> list[dict[str, Any]]:
    """Times and errors of all methods."""
    known = list(methods())
    for _, method, inputs, _ in known:
        method(**inputs)
    rounds = [[took(method, inputs) for _, method, inputs, _ in known] for _ in range(ROUNDS)]
    peers = {tones: [name for name, *_ in known].index(f"scikit-rf, {tones} tones a call") for tones in (7, 2000)}
    rows = []
    for index, (name, method, _, reference) in enumerate(known):
        whole, real = errors(reference or method)
        entry = {"method": name, "seconds": statistics.median(times[index] for times in rounds)}
        entry |= {"Z": whole, "Re Z": real}
        for tones, peer in peers.items():
            entry[f"against {tones} tones"] = statistics.median(times[peer] / times[index] for times in rounds)
        rows.append(entry)
    return rows


TARGETS = {  # impedances/s, and times scikit-rf's
    "recursion, grid": (25e6, 3000),
    "recursion, 10^5 triples": (5e6, 500),
    "recursion, 10^6 triples": (5e6, 500),
}


def swept() -> dict[str, Method]:
    """Methods whose errors are looked at over frequency and length."""
    return {
        "recursion": by_name(line.impedance),
        "ABCD matrices": by_name(line_abcd.impedance),
        "exponentials, corrected": by_name(line_closed.impedance),
        "exponentials, B.48 as printed": by_name(line_closed.impedance, as_printed="B.48"),
        "pi ladder, 100 cells": by_name(line_ladder.impedance, cells=100),
        "scikit-rf": lambda **inputs: scikit_rf(**inputs)[0],
    }


ALONG: dict[str, tuple[Any, Callable[[float], Inputs]]] = {
    "frequency_hz": (np.geomspace(1e-9, 1e9, 73), lambda f: PLATE | {"frequency_hz": f}),
    "length_m": (
        np.geomspace(1e-3, 1e3, 49),
        lambda length: (
            PLATE | {"length_m": length, "tip_m": 0.1 * length, "left_m": 0.45 * length, "force_n": 30 * length}
        ),
    ),
}


def sweeps() -> dict[str, Any]:
    """Errors of each method over frequency and over length, None where it has no number, and where its numbers end."""
    found: dict[str, Any] = {}
    for along, (places, inputs_at) in ALONG.items():
        at = [float(place) for place in places]
        runs = [inputs_at(place) for place in at]
        true = [exact(120, **inputs) for inputs in runs]
        found[along] = {"at": at, "errors": {}}
        for name, method in swept().items():
            errors_ = [error_at(method, inputs, z) for inputs, z in zip(runs, true, strict=True)]
            found[along]["errors"][name] = errors_
        found[along]["ends"] = ends(along, at, found[along]["errors"])
    return found


def ends(along: str, at: list[float], errors_: dict[str, list[list[float] | None]]) -> dict[str, float]:
    """Where each method's last number is, to a ten thousandth; methods that have one to the end are left out."""
    found, inputs_at = {}, ALONG[along][1]
    for name, pairs in errors_.items():
        last = max(k for k, pair in enumerate(pairs) if pair)
        if last + 1 == len(at):
            continue
        low, high = at[last : last + 2]
        while high > low * 1.0001:
            middle = (low * high) ** 0.5
            low, high = (middle, high) if error_at(swept()[name], inputs_at(middle), 1.0) else (low, middle)
        found[name] = low
    return found


def error_at(method: Method, inputs: Inputs, true: Any) -> list[float] | None:
    """Errors of Z and of Re Z, None where the method refuses or has no number."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            z = complex(method(**inputs))
    except OutOfRange:
        return None
    return list(off(z, true)) if np.isfinite(z) else None


def misprints() -> list[dict[str, Any]]:
    """What a misprint makes of Z, smallest and largest over five forces and five positions, for each tone."""
    rows = []
    for printed in line_closed.PRINTED:
        for tone in TONES:
            inputs = grid(5, 5) | {"frequency_hz": tone}
            z, wrong = (
                line.impedance(line.PressedLine(**inputs)),
                line_closed.impedance(line.PressedLine(**inputs), printed),
            )
            entry: dict[str, Any] = {"equation": printed, "frequency_hz": tone}
            for what, value in (
                ("off", np.abs(wrong / z - 1)),
                ("Re", wrong.real / z.real),
                ("Im", wrong.imag / z.imag),
            ):
                entry[what] = [float(value.min()), float(value.max())]
            rows.append(entry)
    return rows


def table(rows: list[dict[str, Any]], wrong: list[dict[str, Any]]) -> str:
    """Everything in numbers."""
    lines = ["| method | impedances/s | error of Z | of Re Z | times scikit-rf, 7 tones a call | 2000 tones a call |"]
    lines += ["|---|---|---|---|---|---|"]
    lines += [
        f"| {r['method']} | {1 / r['seconds']:.3g} | {r['Z']:.0e} | {r['Re Z']:.0e} | "
        f"{r['against 7 tones']:.3g} | {r['against 2000 tones']:.3g} |"
        for r in rows
    ]
    lines += ["", "| target | at least | got | met |", "|---|---|---|---|"]
    for r in rows:
        rate, ratio = TARGETS.get(r["method"], (None, None))
        got = [("impedances/s", rate, 1 / r["seconds"])]
        got += [(f"times scikit-rf, {n} tones a call", ratio, r[f"against {n} tones"]) for n in (7, 2000)]
        lines += [
            f"| {r['method']}: {what} | {least:.3g} | {value:.3g} | {'yes' if value >= least else 'no'} |"
            for what, least, value in got
            if least
        ]
    lines += ["", "| as printed | f [Hz] | abs(Z'/Z - 1) | Re Z'/Re Z | Im Z'/Im Z |", "|---|---|---|---|---|"]
    for w in wrong:
        spans = " | ".join(" .. ".join(f"{v:.3g}" for v in w[k]) for k in ("off", "Re", "Im"))
        lines.append(f"| {w['equation']} | {w['frequency_hz']:g} | {spans} |")
    return "\n".join(lines) + "\n"


FAMILIES = {  # how a method's name begins: its colour and mark
    "recursion": ("#c8951d", "o"),
    "ABCD matrices": ("#303436", "D"),
    "exponentials, corrected": ("#8a4fbf", "s"),
    "exponentials, B.48 as printed": ("#c48be8", "s"),
    "pi ladder": ("#3b7dd8", "^"),
    "one-sided ladder": ("#4aa3a2", "v"),
    "scikit-rf": ("#b22222", "X"),
    "ngspice": ("#5a8f3c", "P"),
}


def draw(rows: list[dict[str, Any]]) -> None:
    """Time against error, for Z and for Re Z."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 2, figsize=(9, 5.4), sharey=True, layout="constrained")
    for axes, part in zip(panels, ("Z", "Re Z"), strict=True):
        for family, (colour, mark) in FAMILIES.items():
            own = [r for r in rows if r["method"].startswith(family) and "dZ" not in r["method"]]
            at = [r[part] for r in own], [r["seconds"] for r in own]
            axes.plot(*at, mark, color=colour, ls=":", lw=1, ms=7, label=family)
            for x, y, r in zip(*at, own, strict=True):
                more = r["method"][len(family) :].lstrip(", ").replace("10^5", "$10^5$").replace("10000", "$10^4$")
                if "10^6" not in more:
                    side = {"xytext": (0, 7), "ha": "center"} if "one" in family else {"xytext": (7, 0), "va": "center"}
                    axes.annotate(more, (x, y), textcoords="offset points", fontsize=8, **side)
        axes.set(xscale="log", yscale="log", xlim=(1e-16, 1e5), xlabel=f"largest relative error of {part}")
        axes.set_xticks([10.0**k for k in range(-16, 5, 4)])
        axes.grid(alpha=0.3)
    panels[0].set(ylabel="processor time per impedance [s]", ylim=(1e-8, 1))
    figure.suptitle(
        "The pressed line: time against error over 224 reference cases; left and below is better", fontsize=11
    )
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    figure.savefig(RESULTS / "line.png", dpi=100)


def draw_stability(found: dict[str, Any]) -> None:
    """Error over frequency and over length; a cross where a method's numbers end."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 2, figsize=(9, 6.6), sharex="col", sharey=True, layout="constrained")
    for column, (along, label) in enumerate(
        (("frequency_hz", "frequency [Hz]"), ("length_m", "length at 99.7 kHz [m]"))
    ):
        at, errors_, last = (found[along][key] for key in ("at", "errors", "ends"))
        for row, part in enumerate(("Z", "Re Z")):
            axes = panels[row, column]
            for name, pairs in errors_.items():
                colour = next(c for start, (c, _) in FAMILIES.items() if name.startswith(start))
                known = [(x, max(pair[row], 1e-17)) for x, pair in zip(at, pairs, strict=True) if pair]
                known += [(last[name], known[-1][1])] if name in last else []
                top = name == "recursion"
                axes.plot(
                    *zip(*known, strict=True), color=colour, lw=2.5 if top else 1.3, zorder=3 if top else 2, label=name
                )
                if name in last:
                    axes.plot(*known[-1], "x", color=colour, ms=9, mew=2.5, zorder=4)
            axes.set(xscale="log", yscale="log", ylim=(3e-18, 1e6), ylabel=f"relative error of {part}")
            axes.axhline(1, color="grey", lw=0.8, ls="--")
            axes.grid(alpha=0.3)
        panels[1, column].set_xlabel(label)
    figure.suptitle(
        "Where each method fails: above 1 nothing is left; a cross: from here on it has no number", fontsize=11
    )
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    figure.savefig(PICTURES / "line-stability.png", dpi=100)


def main() -> None:
    """Measure everything and write the results; with --draw only draw those of the last time."""
    if "--draw" not in sys.argv:
        RESULTS.mkdir(exist_ok=True)
        busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
        found = {"load": busy, "methods": measure(), "sweeps": sweeps(), "misprints": misprints()}
        (RESULTS / "line.json").write_text(json.dumps(found, indent=1) + "\n", "utf-8")
        text = f"Processor time, one thread. {os.cpu_count()} cores, {busy:.1f} programs at work on them before.\n\n"
        text += table(found["methods"], found["misprints"])
        (RESULTS / "line.md").write_text(text, "utf-8")
        print(text)
    last = json.loads((RESULTS / "line.json").read_text("utf-8"))
    draw(last["methods"])
    draw_stability(last["sweeps"])


if __name__ == "__main__":
    main()
