"""``sensorgen compress``: how a cell gives way under stress, and what that does to its capacitance."""

from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf
from sensorgen.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design import Design
    from sensorgen.models.press2d import Elastic, Pressed

_MOST_POINTS = 200

OWN: list[click.Parameter] = [
    click.Option(["--stress"], default="0:100:10", metavar="FIRST:LAST:STEP", help="Stresses [kPa]."),
    click.Option(["--base"], type=OneOf(["bonded", "sliding"]), default="bonded", help="How the bottom is held."),
    click.Option(["--sides", "period"], type=OneOf(["fixed", "free"]), default="fixed", help="Whether the sides of the cell stay, or give way."),
    click.Option(["--top"], type=OneOf(["even", "rigid"]), default="even", help="Even pressure, or a stiff plate."),
    click.Option(["--contact"], type=OneOf(["frictionless", "stick"]), default="frictionless", help="Faces that touch."),
    click.Option(["--check-mesh"], is_flag=True, help="Solve on a finer mesh too, and compare."),
    click.Option(["--plot"], metavar="FILE", help="Draw displacement and capacitance over stress."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the curve as JSON."),
]


def _work(design: "Design", *, stress: str, check_mesh: bool, plot: str | None, as_json: bool, **held: str) -> int:
    from sensorgen.models import press2d
    from sensorgen.models._press.mesh import Fineness
    from sensorgen.models._press.support import Held

    cell = press2d.cell(design.in_use, getattr(design.params, "period_mm", None))
    inputs = (cell, _solids(design), [1e3 * kpa for kpa in stresses_kpa(stress)], _permittivity(design))
    found = press2d.press(*inputs, held=Held(**held))
    if check_mesh:
        found = press2d.compared(found, press2d.press(*inputs, held=Held(**held), fineness=Fineness().finer()))
    data = _plain(found, held)
    if plot:
        _draw(data, plot)
    show.as_json(data) if as_json else _table(data)
    return 0


def stresses_kpa(text: str) -> list[float]:
    """Stresses from FIRST:LAST:STEP [kPa]; the first is 0.

    >>> stresses_kpa("0:100:50")
    [0.0, 50.0, 100.0]
    """
    try:
        first, last, step = (float(word) for word in text.split(":"))
    except ValueError:
        raise BadInput(f"--stress {text!r}: expected FIRST:LAST:STEP in kPa, as in 0:100:10") from None
    if not (first == 0 < step <= last < float("inf")):
        raise OutOfRange(f"--stress {text!r}: expected 0 first, then a last stress and a step above 0")
    if last / step > _MOST_POINTS:
        raise OutOfRange(f"--stress {text!r}: {last / step:.0f} points; expected at most {_MOST_POINTS}")
    return [step * k for k in range(int(last / step * (1 + 1e-12)) + 1)]


def _solids(design: "Design") -> dict[str, "Elastic"]:
    from sensorgen.models.press2d import Elastic

    used = design.used()
    names = {body.material for body in design.in_use.bodies}
    loaded = {name: design.material(name) for name in sorted(names)}
    return {
        name: Elastic(m.value("youngs_modulus_pa", used[name]).value, m.value("poisson_ratio", used[name]).value)
        for name, m in loaded.items()
    }


def _permittivity(design: "Design") -> dict[str, float]:
    used = design.used() | {"air": ""}
    names = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return {name: design.material(name).value("relative_permittivity", used[name]).value for name in sorted(names)}


def _plain(found: "Pressed", held: dict[str, str]) -> dict[str, Any]:
    return {
        "model": "press2d",
        "held": held,
        "stress_kpa": [p / 1e3 for p in found.stress_pa.tolist()],
        "displacement_um": [d * 1e6 for d in found.displacement_m.tolist()],
        "lower_f_per_m2": [c.lower if c else None for c in found.capacitance_f_per_m2],
        "upper_f_per_m2": [c.upper if c else None for c in found.capacitance_f_per_m2],
        "converged_kpa": found.converged_pa / 1e3,
        "faults": list(found.faults),
        "bounds": "of the capacitance of the deformed outlines as computed; the outlines' own error is not in them",
    }


def _table(data: dict[str, Any]) -> None:
    click.echo(f"{'stress [kPa]':>12}  {'displacement [um]':>17}  capacitance [pF/m2]")
    rows = zip(*(data[k] for k in ("stress_kpa", "displacement_um", "lower_f_per_m2", "upper_f_per_m2")), strict=True)
    for stress, moved, lower, upper in rows:
        bounds = f"{lower * 1e12:.6g} to {upper * 1e12:.6g}" if lower is not None else "not known: no mesh"
        click.echo(f"{stress:12.4g}  {moved:17.4g}  {bounds}")
    click.echo(f"converged up to {data['converged_kpa']:.4g} kPa; {', '.join(f'{k} {v}' for k, v in data['held'].items())}")
    for fault in data["faults"]:
        click.echo(click.style(f"not to be trusted: {fault}", fg="red"))


def _draw(data: dict[str, Any], file: str) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    left.plot(data["stress_kpa"], data["displacement_um"], "o-", ms=3)
    left.set(xlabel="stress [kPa]", ylabel="displacement of the top [µm]", ylim=(0, None))
    known = [k for k, c in enumerate(data["lower_f_per_m2"]) if c is not None]
    middle = [(data["lower_f_per_m2"][k] * data["upper_f_per_m2"][k]) ** 0.5 * 1e9 for k in known]
    right.plot([data["stress_kpa"][k] for k in known], middle, "o-", ms=3)
    right.set(xlabel="stress [kPa]", ylabel="capacitance [nF/m²]")
    figure.savefig(file, dpi=150)


command = DesignGroup(
    _work, OWN, name="compress",
    help="Press a cell: displacement and capacitance over stress, by plane-strain finite elements with contact.",
    short_help="Displacement and capacitance under stress.",
)  # fmt: skip
