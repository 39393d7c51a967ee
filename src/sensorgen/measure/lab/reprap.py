"""Gantry with RepRapFirmware 3, over a serial line or HTTP: carries the actuator along X, and raises it along Z.

Moves are queued by the firmware: the answer ``ok`` to G1 says that it is in the queue, not that it has ended, and M114
gives the end of the queue. The place now and the state come from the object model (M409 or ``rr_model``), which needs
firmware 3. M400 is not used: it would hold up every question behind it on a serial line, as homing does.

Serial: USB, or an auxiliary port in raw mode (``M575 P1 B57600 S2`` in config.g); each answer ends with ``ok``. HTTP:
``rr_connect`` opens a session, which ends after 8 s without a request (status 401 then; it is opened again).
Positions are those of the machine: no tool may be selected, and no workplace offset set. Sources: the wiki page "HTTP
requests" of Duet3D/RepRapFirmware, its G-code dictionary, and its source for the answers (version 3.5).
"""

import json
import math
import urllib.parse
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from sensorgen.core.errors import OutOfRange
from sensorgen.core.records import Line, Strict
from sensorgen.measure.lab.devices import Clock, DeviceFault, Identity, Place, WrongDevice
from sensorgen.measure.lab.port import HttpPort, Port

BAUD = 57_600
_ANSWER_S, _HOMING_S, _HTTP_S = 2.0, 120.0, 1.0
_STATUS, _AXES = 'M409 K"state.status"', 'M409 K"move.axes[].machinePosition"'
_QUESTIONS = (_STATUS, _AXES)
_MODEL = "/rr_model?flags=d99fn"
_NAME = "FIRMWARE_NAME:"
_REACHED_MM = 0.02
_PERIOD_S = 0.05  # between two questions over HTTP


class Settings(Strict):
    """Settings of a gantry.

    Attributes
    ----------
    axis : str
        That goes along the specimen.
    origin_mm : float
        Machine position of the axis at the specimen's begin [mm].
    travel_mm : float
        Largest distance from there, either way [mm].
    working_mm : float
        Machine position of Z at the working height [mm].
    clearance_mm : float
        By which ``lift`` raises the actuator above it: more than its piston reaches [mm].
    lift_mm_s : float
        Speed of Z [mm/s].
    baud : int
        Of a serial line.
    password : str
        Of HTTP; the firmware's default is reprap.
    """

    axis: Literal["X", "Y"] = "X"
    origin_mm: Annotated[float, Field(ge=-2000, le=2000)] = 0.0
    travel_mm: Annotated[float, Field(gt=0, le=2000)] = 500.0
    working_mm: Annotated[float, Field(ge=0, le=2000)] = 0.0
    clearance_mm: Annotated[float, Field(gt=0, le=500)] = 30.0
    lift_mm_s: Annotated[float, Field(gt=0, le=100)] = 10.0
    baud: Annotated[int, Field(strict=False, ge=1200, le=1_000_000)] = BAUD
    password: Line = "reprap"  # noqa: S105 -- the public default of the firmware


@dataclass(frozen=True)
class FirmwareState:
    """State of the firmware.

    Attributes
    ----------
    status : str
        ``idle``, ``busy``, ``halted`` ...
    axes_mm : tuple of float
        Machine position of X, Y, Z [mm].
    """

    status: str
    axes_mm: tuple[float, ...]

    @classmethod
    def of(cls, status: Any, axes_mm: Any, address: str) -> Self:
        """State by the firmware's words; DeviceFault where they are none."""
        if not isinstance(status, str):
            raise DeviceFault(f"{address} has no state: {status!r:.60}")
        try:
            return cls(status, tuple(float(each) for each in axes_mm))
        except (TypeError, ValueError):
            raise DeviceFault(f"{address} has no positions of axes: {axes_mm!r:.60}") from None


class SerialLink:
    """The firmware at a serial line: answers come in the order of the commands, each ended by ``ok``."""

    def __init__(self, port: Port, clock: Clock) -> None:
        self.address = port.address
        self._port, self._clock = port, clock
        self._waiting: deque[str] = deque()
        self._since_s = 0.0
        self._lines: list[str] = []
        self._partial = b""
        self._told: dict[str, Any] = {}  # by question
        self._report: FirmwareState | None = None
        self._identifying = 0

    def identify(self) -> str:
        """Answer to M115, after those to what another program asked before; nothing else was sent before."""
        self._port.write(b"M115\n")
        self._identifying += 1
        until = self._clock.now() + _ANSWER_S
        lines: list[str] = []
        while (left := until - self._clock.now()) > 0:
            line = self._port.read_until(b"\n", left).decode("ascii", "replace").strip()
            if line != "ok":
                lines.append(line)
            elif _NAME in (answer := " ".join(lines)):
                lines = []
                self._identifying -= 1
                if not self._identifying:
                    return answer
        raise DeviceFault(
            f"{self.address}, asked M115, answers {' '.join(lines)!r:.80}; check cable, power and baud rate"
        )

    def send(self, *codes: str) -> None:
        """Send G-code without waiting for its end."""
        for code in codes:
            if not self._waiting:
                self._since_s = self._clock.now()
            self._waiting.append(code)
            self._port.write(code.encode() + b"\n")
            if code not in _QUESTIONS:
                self._report = None

    def report(self) -> FirmwareState | None:
        """Newest state; a question is sent when the last one is answered."""
        self._receive()
        if not self._waiting:
            self.send(*_QUESTIONS)
            self._receive()
        if not self._waiting:
            return self._report
        limit_s = _HOMING_S if self._waiting[0].startswith("G28") else _ANSWER_S
        if self._clock.now() - self._since_s > limit_s:
            raise DeviceFault(
                f"{self.address} does not answer {self._waiting[0]!r} in {limit_s:g} s"
                f" (received {self._partial!r:.40}); check cable and power"
            )
        return self._report

    def emergency(self) -> None:
        """Stop at once: the firmware looks for M112 before anything that is queued, which it drops."""
        self._port.write(b"M112\n")
        self._waiting.clear()
        self._report = None

    def close(self) -> None:
        """Give the line back."""
        self._port.close()

    def _receive(self) -> None:
        """Take the lines that have come."""
        while True:
            self._partial += self._port.read_until(b"\n", 0.0)
            if not self._partial.endswith(b"\n"):
                return
            line, self._partial = self._partial.decode("ascii", "replace").strip(), b""
            if line == "ok":
                self._answered()
            elif line:
                self._lines.append(line)

    def _answered(self) -> None:
        """One command has its answer."""
        lines, self._lines = self._lines, []
        text = " ".join(lines)
        if not self._waiting:
            raise DeviceFault(f"{self.address} answers {text or 'ok'!r:.80} to nothing; has another program the line?")
        code = self._waiting.popleft()
        self._since_s = self._clock.now()
        if "Error" in text:
            raise DeviceFault(f"{self.address} answers {code!r} with {text!r:.120}")
        if code in _QUESTIONS:
            self._told[code] = _object(text, self.address, "JSON of the object model").get("result")
        if code == _AXES and not self._waiting:  # nothing was sent after the question
            self._report = FirmwareState.of(self._told.get(_STATUS), self._told[_AXES], self.address)


class WebLink:
    """The firmware at an address of HTTP: one request at a time, each at most a second."""

    def __init__(self, web: HttpPort, clock: Clock, password: str) -> None:
        self.address = web.address
        self._web, self._clock, self._password = web, clock, password
        self._replies = 0
        self._busy = 0
        self._next_s = -math.inf
        self._report: FirmwareState | None = None

    def identify(self) -> str:
        """Open a session, which only this firmware does, and ask M115."""
        self._connect()
        self._replies = self._seen(self._model())
        self.send("M115")
        until = self._clock.now() + _ANSWER_S
        while self._clock.now() < until:
            reply = self._get("/rr_reply").strip()
            if _NAME in reply:
                self._replies = self._seen(self._model())
                return reply
            self._clock.wait_until(self._clock.now() + _PERIOD_S)
        raise DeviceFault(f"{self.address} does not answer M115; is it busy?")

    def send(self, *codes: str) -> None:
        """Put G-code into the firmware's buffer, as one request so that it goes in whole or not at all."""
        text = urllib.parse.quote("\n".join(codes))
        answer = _object(self._get(f"/rr_gcode?gcode={text}"), self.address)
        if answer.get("err") or "buff" not in answer:
            raise DeviceFault(f"{self.address} does not take {codes[0]!r} ...: {answer!r:.80}; its buffer is full")
        self._report, self._next_s = None, -math.inf

    def report(self) -> FirmwareState | None:
        """Newest state, asked for at most 20 times a second; replies are fetched when there are new ones."""
        now = self._clock.now()
        if now < self._next_s:
            return self._report
        model = self._model()
        self._next_s = now + _PERIOD_S
        if not model:
            return self._report
        seen = self._seen(model)
        if seen != self._replies:
            self._replies = seen
            reply = self._get("/rr_reply").strip()
            if "Error" in reply:
                raise DeviceFault(f"{self.address} replies {reply!r:.120}")
        try:
            axes = tuple(float(each["machinePosition"]) for each in model["move"]["axes"])
            self._report = FirmwareState(str(model["state"]["status"]), axes)
        except (KeyError, TypeError, ValueError):
            raise DeviceFault(f"{self.address} has no state.status or move.axes in its object model") from None
        return self._report

    def emergency(self) -> None:
        """Stop at once: the firmware looks for M112 before anything that is queued."""
        self._get("/rr_gcode?gcode=M112")

    def close(self) -> None:
        """End the session."""
        with suppress(DeviceFault):
            self._web.get("/rr_disconnect", _HTTP_S)

    def _connect(self) -> None:
        status, content = self._web.get(f"/rr_connect?password={urllib.parse.quote(self._password)}", _HTTP_S)
        try:
            answer = json.loads(content)
            error, known = answer["err"], status == 200
        except (ValueError, KeyError, TypeError):
            known, error = False, None
        if not known:
            raise WrongDevice(
                f"{self.address} answers rr_connect with {status} {content!r:.60}; expected RepRapFirmware"
            )
        if error:
            why = {1: "the password is wrong", 2: "it has no free session: close other browsers and programs"}
            raise DeviceFault(f"{self.address}: {why.get(error, f'error {error}')}")

    def _get(self, path: str) -> str:
        """Content of an answer; if the session has ended, it is opened again, and the refused request repeated."""
        for attempt in range(2):
            status, content = self._web.get(path, _HTTP_S)
            if status == 200:
                return content.decode("utf-8", "replace")
            if status == 401 and attempt == 0:
                self._connect()
            elif status == 503:
                return ""
            else:
                break
        raise DeviceFault(f"{self.address} answers {path.partition('?')[0][1:]} with status {status}")

    def _model(self) -> dict[str, Any]:
        """Live part of the object model; empty where the firmware was short of memory, which passes."""
        text = self._get(_MODEL)
        self._busy = 0 if text else self._busy + 1
        if self._busy > 5:
            raise DeviceFault(f"{self.address} is short of memory again and again (status 503)")
        result = _object(text, self.address, "JSON of the object model").get("result") if text else {}
        if not isinstance(result, dict):
            raise DeviceFault(f"{self.address} sends no object model: {text!r:.60}")
        return result

    def _seen(self, model: dict[str, Any]) -> int:
        sequence = model.get("seqs", {})
        return int(sequence.get("reply", self._replies)) if isinstance(sequence, dict) else self._replies


class RepRapStage:
    """Driver of the gantry.

    Parameters
    ----------
    link : SerialLink or WebLink
        Way to the firmware.
    clock : Clock
        Of the run.
    settings : Settings
        Of this gantry.
    """

    def __init__(self, link: SerialLink | WebLink, clock: Clock, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self._link, self._clock = link, clock
        self._known = False
        self._goal_mm: dict[str, float] = {}
        self._place = Place(clock.now(), 0.0, 0.0, moving=True)

    def identify(self) -> Identity:
        """Ask M115.

        Raises
        ------
        WrongDevice
            It is no RepRapFirmware, or older than 3, which has no object model.
        """
        answer = self._link.identify()
        fields = answer.partition(_NAME)[2]
        name, _, rest = fields.partition("FIRMWARE_VERSION:")
        version, _, board = rest.partition("ELECTRONICS:")
        major = version.strip().partition(".")[0]
        if "RepRapFirmware" not in name or not (major.isdecimal() and int(major) >= 3):
            raise WrongDevice(
                f"{self._link.address} answers M115 with {answer!r:.100}; expected RepRapFirmware 3 or later"
            )
        self._known = True
        return Identity(f"{name.strip()} on {board.split('FIRMWARE_DATE')[0].strip()}", "", version.split()[0])

    def start(self) -> None:
        """Raise the actuator, also if the zero of Z is unknown, find all zeros (G28), and raise it to its clearance."""
        if not self._known:
            self.identify()
        speed = f"F{60 * self.settings.lift_mm_s:g}"
        self._goal_mm = {}
        self._link.send("G91", f"G1 H2 Z{self.settings.clearance_mm:g} {speed}", "G90", "G28")
        self.lift()

    def move(self, position_mm: float, speed_mm_s: float) -> None:
        """Begin to go to a place along the specimen [mm], [mm/s].

        Raises
        ------
        OutOfRange
            Farther than the travel, or no speed.
        """
        if not (abs(position_mm) <= self.settings.travel_mm and 0 < speed_mm_s <= 1000):
            raise OutOfRange(
                f"place {position_mm:g} mm at {speed_mm_s:g} mm/s; expected within {self.settings.travel_mm:g} mm,"
                " above 0 and up to 1000 mm/s"
            )
        self._begin(self.settings.axis, self.settings.origin_mm + position_mm, speed_mm_s)

    def lower(self) -> None:
        """Begin to lower the actuator to its working height."""
        self._begin("Z", self.settings.working_mm, self.settings.lift_mm_s)

    def lift(self) -> None:
        """Begin to raise the actuator by its clearance; after what is queued, as all of the firmware's moves."""
        self._begin("Z", self.settings.working_mm + self.settings.clearance_mm, self.settings.lift_mm_s)

    def read(self) -> Place:
        """Newest place; over a serial line that of the question before, so that nothing is waited for.

        Raises
        ------
        DeviceFault
            No answer, an error message, or a firmware that has halted.
        """
        report = self._link.report()
        if report is None:
            self._place = Place(self._place.time_s, self._place.position_mm, self._place.height_mm, moving=True)
            return self._place
        if report.status in ("halted", "off"):
            raise DeviceFault(
                f"{self._link.address} is halted: after an emergency stop reset it or send M999, then start again"
                if report.status == "halted"
                else f"{self._link.address} has no power for its motors"
            )
        axes = dict(zip("XYZ", report.axes_mm, strict=False))
        along = axes.get(self.settings.axis, math.nan) - self.settings.origin_mm
        height = axes.get("Z", math.nan) - self.settings.working_mm
        off = any(not abs(axes.get(name, math.nan) - goal) <= _REACHED_MM for name, goal in self._goal_mm.items())
        self._place = Place(self._clock.now(), along, height, moving=off or report.status != "idle")
        return self._place

    def stop(self) -> None:
        """Emergency stop (M112): every move ends at once, and none is possible before a restart and homing."""
        self._goal_mm = {}
        self._link.emergency()

    def close(self) -> None:
        """Give the connection back."""
        self._link.close()

    def _begin(self, axis: str, position_mm: float, speed_mm_s: float) -> None:
        self._goal_mm[axis] = position_mm
        self._link.send("G90", f"G1 {axis}{position_mm:.3f} F{60 * speed_mm_s:.1f}")


def stage(port: Any, clock: Clock, settings: Settings) -> RepRapStage:
    """Driver at a serial line or an address of HTTP."""
    web = isinstance(port, HttpPort)
    return RepRapStage(WebLink(port, clock, settings.password) if web else SerialLink(port, clock), clock, settings)


def _object(text: str, address: str, expected: str = "JSON") -> dict[str, Any]:
    """JSON object of an answer."""
    try:
        answer = json.loads(text)
    except ValueError:
        answer = None
    if not isinstance(answer, dict):
        raise DeviceFault(f"{address} answers {text!r:.80}; expected {expected}")
    return answer
