"""Faults on demand of a simulated laboratory, by name."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from pydantic import Field, model_validator

from sensorgen.core.errors import UnknownName
from sensorgen.core.records import Strict

Strikes = Literal["actuator", "stage", "analyser", "lcr-meter", "multimeter", "rig"]


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong.

    Attributes
    ----------
    strikes : str
        Which simulator.
    sets : str
        Value of its attribute ``fault``.
    about : str
        What happens, in one line.
    """

    strikes: Strikes
    sets: str
    about: str


_LINES = {
    "silent": "obeys, but sends no answers",
    "hung": "neither answers nor acts; what was set before goes on",
    "garbage": "answers with bytes that mean nothing",
    "identity": "says that it is another device",
    "truncated": "loses the second half of each answer",
    "cut": "its cable is pulled out: every message fails",
    "error": "reports an error of its own",
    "stuck": "accepts set points and ignores them",
}
BY_DEVICE: dict[Strikes, dict[str, str]] = {
    "actuator": _LINES
    | {
        "error": "switches its motor off and sets the error bit of its status",
        "echo": "sends each command back before its answer",
        "runaway": "pushes with the largest force that its limit allows",
    },
    "stage": _LINES,
    "lcr-meter": _LINES | {"overload": "is beyond its range"},
    "multimeter": _LINES | {"overload": "is beyond its range"},
    "analyser": {
        "unplugged": "its cable is pulled out",
        "hung": "sends no more samples",
        "data loss": "loses samples between two blocks",
        "clipped": "its inputs saturate",
        "nan": "sends no numbers",
        "silent": "measures zero volt",
        "generator off": "puts out no signal",
        "in use": "is held by another program",
        "wrong device": "says that it is another device",
    },
    "rig": {
        "cable out": "the specimen's cable is pulled out: an open circuit",
        "power loss": "the actuator's motor gives no force; weight and friction remain",
        "jammed": "the piston moves no more",
        "stage moves": "the stage moves along the specimen by itself",
        "short": "1 kohm between the electrodes, as long as the force is below 2 N",
    },
}
FAULTS: Mapping[str, Fault] = {
    f"{device} {name}": Fault(device, name, about) for device, own in BY_DEVICE.items() for name, about in own.items()
}
"""All of them, by name: the simulator and what happens to it."""


class Planted(Strict):
    """A fault of an experiment.

    Attributes
    ----------
    what : str
        One of ``FAULTS``, as "actuator hung".
    at_s : float or None
        When it strikes, by the rig's clock [s].
    at_force_n : float or None
        Or as soon as the force on the specimen is so high [N].
    for_s : float or None
        How long it lasts; for good if None [s].
    """

    what: str
    at_s: Annotated[float, Field(ge=0)] | None = None
    at_force_n: Annotated[float, Field(gt=0)] | None = None
    for_s: Annotated[float, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one(self) -> "Planted":
        if self.what not in FAULTS:
            raise ValueError(str(UnknownName("fault", self.what, list(FAULTS))))
        if (self.at_s is None) == (self.at_force_n is None):
            raise ValueError("a fault needs one of at_s and at_force_n")
        return self


class Faulty(Protocol):
    """A simulator that faults strike.

    Attributes
    ----------
    fault : str
        Name of its fault, "" for none.
    """

    fault: str


class FaultSchedule:
    """Faults that wait for their time, and those that last.

    Parameters
    ----------
    planted : iterable of Planted
        What goes wrong.
    """

    def __init__(self, planted: Iterable[Planted]) -> None:
        self._waiting = list(planted)
        self._lasting: list[tuple[float, Fault]] = []
        self._targets: dict[str, Faulty] = {}

    def attach(self, strikes: Strikes, simulator: Faulty) -> None:
        """Name the simulator that faults of a kind of device strike."""
        self._targets[strikes] = simulator

    def update(self, time_s: float, force_n: float) -> None:
        """Let faults begin and end that are due [s], [N]."""
        self._begin(time_s, force_n)
        for end_s, fault in [(t, f) for t, f in self._lasting if time_s >= t]:
            self._lasting.remove((end_s, fault))
            target = self._targets.get(fault.strikes)
            if target and target.fault == fault.sets:
                target.fault = ""

    def _begin(self, time_s: float, force_n: float) -> None:
        for one in tuple(self._waiting):
            if not (time_s >= one.at_s if one.at_s is not None else force_n >= (one.at_force_n or 0.0)):
                continue
            self._waiting.remove(one)
            fault = FAULTS[one.what]
            if fault.strikes in self._targets:
                self._targets[fault.strikes].fault = fault.sets
            if one.for_s is not None:
                self._lasting.append((time_s + one.for_s, fault))

    def __bool__(self) -> bool:
        """Test whether anything is to come."""
        return bool(self._waiting or self._lasting)
