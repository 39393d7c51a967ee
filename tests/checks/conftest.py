"""Small sensors with one planted defect, and the findings about them."""

from collections.abc import Callable

import pytest

from sensorgen.checks import rules as checks
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer, Quality, load_printer, load_quality
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Body, Prism, Scene, box

Findings = Callable[..., list[Finding]]

WIDE = 20.0


@pytest.fixture
def printer() -> Printer:
    """The thesis's printer: bed 390 x 170 mm, nozzle 0.4 mm, line 0.44 mm."""
    return load_printer("diabase-h5")


@pytest.fixture
def fine() -> Quality:
    """Layers of 0.1 mm."""
    return load_quality("fine")


@pytest.fixture
def extrafine() -> Quality:
    """Layers of 0.06 mm."""
    return load_quality("extrafine")


@pytest.fixture
def sensor() -> Callable[..., Scene]:
    """A function that lays a film, a top electrode and some bodies on a bottom electrode of 20 x 20 mm."""

    def plate(z0: float, z1: float) -> tuple[Prism]:
        return (box(0, WIDE, 0, WIDE, z0, z1),)

    def make(*bodies: Body, film_mm: float = 0.6, bottom_mm: float = 0.3) -> Scene:
        """``bodies`` go on top of it, at 1.2 mm and above."""
        roof = bottom_mm + film_mm
        stack = [
            Body("low", "etpu", plate(0, bottom_mm), "bottom"),
            Body("film", "x60", plate(bottom_mm, roof)),
            Body("high", "etpu", plate(roof, roof + 0.3), "top"),
            *bodies,
        ]
        height = max(prism.span("z")[1] for body in stack for prism in body.pieces)
        return Scene(tuple(stack), (WIDE, WIDE, height))

    return make


@pytest.fixture
def findings(printer, fine) -> Findings:
    """A function that checks a scene, on the thesis's printer and with fine layers unless told otherwise."""

    def check(scene: Scene, rule: str = "", body: str = "", gap_mm: float | None = None, **on) -> list[Finding]:
        if gap_mm is None:
            gap_mm = meshes.electrode_gap_mm(scene, {b.name: meshes.mesh(b) for b in scene.bodies})
        found = checks.findings(scene, on.get("printer", printer), on.get("quality", fine), gap_mm)
        return [f for f in found if f.rule.startswith(rule) and body in ("", f.body)]

    return check
