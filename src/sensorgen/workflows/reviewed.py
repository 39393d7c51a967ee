"""Design rule check of a design together with the printer and quality that the user has written."""

from dataclasses import replace

from sensorgen.checks.review import Review, Step, review
from sensorgen.design.design import Design


def reviewed(design: Design, step: Step = lambda _: None, walls: str = "") -> Review:
    """All findings about a design, first those of its own printer; arguments as of :func:`review`."""
    held = review(design, step, walls)
    if not design.own.keys() & {"printers", "qualities"}:
        return held  # what ships is tested before
    from sensorgen.export import machine

    return replace(held, findings=[*design.waived(machine.of_design(design)), *held.findings])
