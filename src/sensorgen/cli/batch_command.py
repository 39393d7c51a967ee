"""``sensorgen batch``: a plan of several sensors to the files of one plate; and whether they are still the same."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from sensorgen.cli import show
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.export.slicers import TIME_LIMIT_S

if TYPE_CHECKING:
    from sensorgen.workflows.batch import Batch
    from sensorgen.workflows.batch.record import Differences

FOUND_ERRORS = FOUND_DIFFERENCES = 1


class _PlanGroup(click.Group):
    """A command whose first word is a plan's file, or ``verify``."""

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """``verify``, or the command for a plan."""
        return super().get_command(ctx, name) or _plan_command(name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Take the first word; an option in its place is the user's slip."""
        if args[0].startswith("-") and not ctx.resilient_parsing:
            raise BadInput(f"{args[0]} stands before the plan; write {ctx.command_path} PLAN.yaml {args[0]} ...")
        return args[0], self.get_command(ctx, args[0]), args[1:]

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Files, and ``verify``."""
        return [CompletionItem(incomplete, type="file"), *super().shell_complete(ctx, incomplete)]


def _plan_command(name: str) -> click.Command:
    return click.Command(
        name,
        params=[
            click.Option(
                ["--out"], default="out", show_default=True, metavar="DIR", help="Folder for batches' folders."
            ),
            click.Option(["--no-gcode"], is_flag=True, help="Leave out slicing, which takes most of the time."),
            click.Option(
                ["--time-limit", "time_limit_s"],
                type=float,
                default=TIME_LIMIT_S,
                show_default=True,
                metavar="SECONDS",
                help="End a slicer after this time.",
            ),
            click.Option(["--force"], is_flag=True, help="Write the files even if checks report errors."),
            click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
            click.Option(["--json", "as_json"], is_flag=True, help="Print the record as JSON."),
        ],
        callback=lambda **given: _make(name, **given),
        help="Write all files of a plan's plate.",
    )


def _make(plan: str, *, out: str, no_gcode: bool, time_limit_s: float, force: bool, strict: bool, as_json: bool) -> int:
    from sensorgen.core.errors import Unprintable
    from sensorgen.workflows.batch import STEPS, make

    if not 0 < time_limit_s < float("inf"):
        raise OutOfRange(f"--time-limit {time_limit_s:g}; expected seconds above 0")
    try:
        with show.progress(STEPS) as step:
            made = make(
                Path(plan), Path(out), gcode=not no_gcode, time_limit_s=time_limit_s, force=force, strict=strict,
                step=step,
            )  # fmt: skip
    except Unprintable as error:
        if as_json:
            show.as_json({"folder": None, "findings": [f.as_dict() for f in error.findings]})
        else:
            show.findings(error.findings)
        raise
    if as_json:
        show.as_json({"folder": str(made.folder), **made.record})
    else:
        _say(made)
    return FOUND_ERRORS if made.gcode_errors() or (made.lost() and not force) else 0


def _say(made: "Batch") -> None:
    record = made.record
    click.echo(f"{record['batch']}: {len(record['specimens'])} specimens on {record['printer']}, {record['quality']}")
    for name, s in record["specimens"].items():
        x, y = s["centre_mm"]
        expected = _predicted(record["predictions"][s["design_id"]])
        click.echo(f"{s['order']:4}  {name:28} {s['design']:24} at {x:7.1f} {y:7.1f} mm  {expected}")
    click.echo("\nchecklist")
    for line in record["checklist"]:
        click.echo(f"  [ ] {line}")
    click.echo("\nfindings, as sensorgen check shows them")
    for name, found in made.findings.items():
        severities = [f.severity for f in found if not f.waiver]
        click.echo(f"  {name}: {severities.count('error')} errors, {severities.count('warning')} warnings")
    for slicer, used in record["slicers"].items():
        click.echo(f"\n{slicer} {used['version']}: {_taken(used)}")
        for f in used["findings"]:
            click.echo(f"  {f['severity']}: line {f['line']}: {f['message']}; {f['advice']}")
        for printed in used["printed"].values():
            click.echo(f"  {printed['design']} as printed: {_printed(printed)}")
    click.echo(f"\n{made.folder}: {len(record['files']) + 1} files")


def _taken(used: dict[str, Any]) -> str:
    """Time and filament of a file, as its check sums them up."""
    spools = (
        f"T{t['tool']} {t['filament_mm'] / 1000:.2f} m" + (f", {t['mass_g']:.1f} g" if t["mass_g"] is not None else "")
        for t in used["tools"]
    )
    return f"at least {used['time_s'] / 3600:.1f} h; {'; '.join(spools)}; {used['tool_changes']} tool changes"


def _predicted(data: dict[str, Any]) -> str:
    """A prediction in one line."""
    from sensorgen.prediction.results import from_json

    found = from_json(json.dumps(data))
    if found.capacitance is None:
        return "no prediction"
    resistance = sum(r.value for r in found.resistance.values())
    return f"R {show.si(resistance, 'ohm')}, C {show.si(found.capacitance.value, 'F')}"


def _printed(printed: dict[str, Any]) -> str:
    """The print of a design, in one line."""
    if "reason" in printed:
        return str(printed["reason"])
    from sensorgen.prediction.results import from_json

    found = from_json(json.dumps(printed["prediction"]))
    gaps = [f"{p.gap.value * 1e3:g} mm" for p in (found, found.drawn) if p and p.gap]
    lost = sum(f["severity"] == "error" and not f["waiver"] for f in printed["findings"])
    parts = [f"electrode gap {' (drawn '.join(gaps)})" if len(gaps) > 1 else "", _predicted(printed["prediction"])]
    return ", ".join(filter(None, parts)) + (f"; {lost} layers of bodies are not printed at all" if lost else "")


@click.command("verify", short_help="Hash every file again and say what differs.")
@click.argument("folder")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def _verify(folder: str, as_json: bool) -> int:
    """Hash every file of a batch's folder again, and say what differs from its record; exit code 1 if anything does."""
    from sensorgen.workflows.batch.record import differences

    found = differences(Path(folder))
    if as_json:
        show.as_json(vars(found))
    else:
        _tell(folder, found)
    return FOUND_DIFFERENCES if found else 0


def _tell(folder: str, found: "Differences") -> None:
    for word in ("missing", "changed", "extra"):
        for name in getattr(found, word):
            click.echo(f"{word:8} {name}")
    if found.record:
        click.echo("changed  batch.json: it does not hold what was written")
    click.echo(f"{folder}: {'differs from its record' if found else 'as recorded'}")


command = _PlanGroup(
    "batch",
    commands=[_verify],
    options_metavar="",
    subcommand_metavar="{PLAN.yaml|verify} [OPTIONS]",
    context_settings={"ignore_unknown_options": True},
    help="""Put several sensors on one plate: 3MF, G-code, labels, and a record of what lies where.

    \b
    sensorgen batch plan.yaml            all files of the plan's plate
    sensorgen batch verify out/NAME      are they still what was written?

    docs/batch.md has an example of a plan.
    """,
    epilog="PLAN.yaml --help lists the options.",
    short_help="Put several sensors on one plate, with a record.",
)
