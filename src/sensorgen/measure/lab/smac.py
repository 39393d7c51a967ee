"""SMAC linear motor actuator on an LCC-10 controller, over RS-232: 115200 baud, lines end in CR, no echo.

``NODE R OBJECT`` asks for a value, ``0x20 W OBJECT VALUE`` answers; ``NODE W OBJECT VALUE`` sets one without an answer.
The controller follows CiA 402: control word 6, 7, 15 switches the motor on, 6 off; modes 1 position, 4 force, 6 homing.
Source: SMAC's programming guide of the "embedded motion control library" and technical notes Serial, Forces, Homing,
Softland and Reset Error, in the public repository ``martijnschouten/lab-equipment-matlab-drivers``, whose program
MatlabForceControl also gives the homing (method -1: to the upper end, then to the index) and its speeds.

Watchdog: macro 59, a program in the controller, lifts by force when its timer 3 reaches 0 (interrupt 7); every reading
sets the timer again. Sources: programming guide 5.3 to 5.5 (objects 0x2C04 to 0x2C08), and MatlabForceControl.mlm for
the coding of commands; macros 60 to 63 are the maker's.

Force on the object = per mille of the rated current x ``newton_per_unit`` + ``weight_n`` -+ ``friction_n``; friction
acts against the last movement. Thesis 5.1.2: 0.0167 N per unit, 0.9 N. SMAC's notes give 0.1 to 1 N of friction; it has
to be measured (constant speed down and up: half the difference), so that the default is 0.
"""

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from sensorgen.core.errors import OutOfRange
from sensorgen.core.records import Strict
from sensorgen.measure.lab.devices import Clock, DeviceFault, Extension, Identity, WrongDevice
from sensorgen.measure.lab.port import Port

BAUD = 115_200
_TYPE, _VENDOR, _PRODUCT, _REVISION, _SERIAL = 0x1000, 0x11018, 0x21018, 0x31018, 0x41018
_ERROR, _EMERGENCY, _NOTIFY = 0x603F, 0x11003, 0x52000
_CONTROL, _STATUS, _MODE, _MODE_NOW = 0x6040, 0x6041, 0x6060, 0x6061
_FORCE, _FORCE_NOW, _SLOPE = 0x6071, 0x6077, 0x6087
_LARGEST, _LARGEST_DOWN, _LARGEST_UP = 0x6072, 0x60E0, 0x60E1
_TARGET, _POSITION, _SPEED, _RISE, _FALL = 0x607A, 0x6064, 0x6081, 0x6083, 0x6084
_METHOD, _OFFSET, _HOMING_FORCE = 0x6098, 0x607C, 0x22102
_HOMING = {_METHOD: -1, 0x16099: 10_000, 0x26099: 500, 0x609A: 10_000, 0x12102: 15_000, _OFFSET: 0}
_SIGNED = {
    _FORCE: 16, _FORCE_NOW: 16, _LARGEST_DOWN: 16, _LARGEST_UP: 16, _TARGET: 32, _POSITION: 32, _OFFSET: 32,
    _MODE_NOW: 8, _METHOD: 8,
}  # fmt: skip
_BY_POSITION, _BY_FORCE, _HOME = 1, 4, 6
_FAULT, _ENABLED, _STATE = 0x08, 0x27, 0x6F  # of the status word: CiA 402
_REACHED, _ACKNOWLEDGED, _FAILED = 0x0400, 0x1000, 0x2000  # bits 10, 12 and 13
_OFF, _READY, _ON, _BEGIN, _NEW = 6, 7, 15, 31, 63
_RESET = 128
_PROFILE, _INGENIA = 0x00020192, 0x29C  # servo drive by CiA 402; maker of the controller's library, by the guide
_UNITS = 1000  # per mille
_TRIES = 3
_SETTLED_S, _STRAY = 0.2, 50  # the current follows within milliseconds; per mille, of which its resolution is 20
_STATUS_S = 0.05  # until the status word is valid after the start of homing
_LIFT, _RAMP = 30_000, 200_000  # counts/s, counts/s2
_BURST = 3  # messages before an answer is waited for, where there is time: the controller's memory for them is unknown
_MARGIN_N = 1.0  # of lifting and homing, above weight and friction
_RESET_MACRO, _MACRO, _COMMAND, _CODE, _TIMER = 0x42C04, 0x12C05, 0x22C05, 0x32C05, 0x32C06
_VECTOR, _WATCHES, _MARK = 0x72C07, 0x72C08, 0x642C00  # of interrupt 7; register W100
_OURS, _MACRO_NUMBER, _EMPTY, _RETURN = 0x53454E53, 59, 0xFFFFFFF1FFFFFFFF, 0x022C044000000000
_BYTES = {_MODE: 1, _CONTROL: 2, _FORCE: 2, _MARK: 4}
_ERASE_S, _FEEDS = 0.6, 5  # after a reset of a macro, 0.5 s by the guide; settings of the timer in its time
_ENCODER = (0x7305, 0x7306)
_ERRORS = {
    0x2200: "peak current", 0x2201: "I2T current", 0x6320: "parameter", 0x7305: "encoder", 0x7306: "encoder wire",
    0x8613: "homing took too long", 0xFF04: "phasing", 0xFF20: "overflow of the serial line",
}  # fmt: skip


class Settings(Strict):
    """Settings of an actuator.

    Attributes
    ----------
    node : int
        Number of the controller; 32 as delivered.
    newton_per_unit : float
        Rated current x force constant / 1000 [N].
    weight_n, friction_n : float
        Of the moving part [N].
    mm_per_count, stroke_mm : float
        Step of the encoder, and largest extension [mm].
    timeout_s : float
        Of one answer [s].
    """

    node: Annotated[int, Field(strict=False, ge=1, le=127)] = 32
    newton_per_unit: Annotated[float, Field(gt=0, le=1)] = 0.0167
    weight_n: Annotated[float, Field(ge=0, le=20)] = 0.9
    friction_n: Annotated[float, Field(ge=0, le=5)] = 0.0
    mm_per_count: Annotated[float, Field(gt=0, le=0.1)] = 0.005
    stroke_mm: Annotated[float, Field(gt=0, le=500)] = 50.0
    timeout_s: Annotated[float, Field(gt=0, le=5)] = 0.1

    def units(self, motor_n: float) -> int:
        """Set-point of a force of the motor, never above it [N]."""
        return max(-_UNITS, min(_UNITS, math.floor(motor_n / self.newton_per_unit + 1e-9)))

    def lifting(self) -> int:
        """Set-point that raises the piston."""
        return -self.units(self.weight_n + self.friction_n + _MARGIN_N)


class _Reported(DeviceFault):
    """An error that the controller reports itself: no attempt is repeated."""


@dataclass
class _State:
    """Knowledge of the driver about the controller."""

    known: bool = False
    on: bool = False
    lifting: bool = False
    mode: int = 0
    homed: bool = False
    homing_s: float | None = None
    limit_n: float = 0.0
    target: int = 0
    target_s: float = 0.0
    wanted_n: float = 0.0
    direction: int = 1
    count: int = 0


class SmacActuator:
    """Driver of the actuator; its zero is the encoder's index at the upper end.

    Until homing has ended, :meth:`read` gives the whole stroke as position, so that the tip does not count as lifted.

    Parameters
    ----------
    port : Port
        At 115200 baud.
    clock : Clock
        Of the run.
    settings : Settings
        Of this actuator.
    """

    def __init__(self, port: Port, clock: Clock, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self._port, self._clock = port, clock
        self._state = _State()
        self._confirm: list[tuple[int, int]] = []
        self._watch_s, self._fed_s = 0.0, -math.inf

    def identify(self) -> Identity:
        """Ask for device type and maker, then for its numbers; nothing else is sent before.

        Raises
        ------
        WrongDevice
            It is no servo drive by CiA 402, or not with the library that LCC controllers have.
        """
        kind, vendor = self._ask(_TYPE, _VENDOR)
        if (kind, vendor) != (_PROFILE, _INGENIA):
            raise WrongDevice(
                f"{self._port.address} says device type 0x{kind:X}, maker 0x{vendor:X};"
                f" expected 0x{_PROFILE:X}, 0x{_INGENIA:X}, an LCC-10"
            )
        self._state.known = True
        product, revision, serial = self._ask(_PRODUCT, _REVISION, _SERIAL)
        return Identity(f"SMAC LCC-10 (product 0x{product:X})", str(serial), str(revision))

    def watch(self, seconds: float) -> None:
        """Load the program that lifts the piston when nothing was read for a time; :meth:`start` begins it [s].

        Raises
        ------
        DeviceFault
            The controller does not take it, or macro 59 has another program.
        """
        program = [_command(what, value) for what, value in ((_MARK, _OURS), *_raising(self.settings))] + [_RETURN]
        if (there := self._program(len(program))) != program:
            if there[0] not in (_EMPTY, program[0]):
                raise DeviceFault(f"actuator at {self._port.address}: macro {_MACRO_NUMBER} has another program")
            if there[0] != _EMPTY:
                self._set((_RESET_MACRO, _MACRO_NUMBER))
                self._clock.wait_until(self._clock.now() + _ERASE_S)
            for number, code in enumerate(program):
                self._set((_MACRO, _MACRO_NUMBER), (_COMMAND, number), (_CODE, code))
            if self._program(len(program)) != program:
                raise DeviceFault(f"actuator at {self._port.address} did not take the watchdog's program")
        self._watch_s = seconds

    def _program(self, length: int) -> list[int]:
        """First commands of the watchdog's macro."""
        codes = []
        for number in range(length):
            self._set((_MACRO, _MACRO_NUMBER), (_COMMAND, number))
            codes.append(self._ask(_CODE)[0] % (1 << 64))
        return codes

    def start(self, limit_n: float) -> None:
        """Limit the current to a force on the specimen, switch the motor on, and begin to go to the upper end [N].

        Raises
        ------
        OutOfRange
            The motor cannot exert the force.
        """
        highest = _UNITS * self.settings.newton_per_unit + self.settings.weight_n
        if not 0 < limit_n < highest:
            raise OutOfRange(f"limit of force {limit_n:g} N; expected above 0 and below {highest:g} N")
        most = self.settings.units(limit_n - self.settings.weight_n)
        if not self._state.known:
            self.identify()
        self._state = _State(known=True, limit_n=limit_n, homing_s=self._clock.now(), mode=_HOME)
        self._confirm = []
        up = self.settings.lifting()
        both = max(most, -up)
        self._set((_NOTIFY, 0), (_CONTROL, _OFF), (_CONTROL, _RESET), (_CONTROL, _OFF))
        limits = [(_LARGEST, both), (_LARGEST_DOWN, most), (_LARGEST_UP, -both)]
        self._configure([*limits, (_SLOPE, 100_000), (_RISE, _RAMP), (_FALL, _RAMP)])
        self._configure([*_HOMING.items(), (_HOMING_FORCE, -up)])
        self._set((_MODE, _HOME), (_CONTROL, _READY), (_CONTROL, _ON), (_CONTROL, _BEGIN))
        self._state.on = True
        if self._watch_s:
            self._set((_WATCHES, 0), (_TIMER, round(1000 * self._watch_s)))
            self._configure([(_VECTOR, _MACRO_NUMBER), (_WATCHES, 1)])
            self._fed_s = self._clock.now()

    def move(self, position_mm: float, speed_mm_s: float, force_n: float) -> None:
        """Begin to go to a position with at most a force: the soft landing [mm], [mm/s], [N].

        Raises
        ------
        OutOfRange
            Beyond the stroke, no speed, or a force above the limit.
        """
        if not (0 <= position_mm <= self.settings.stroke_mm and speed_mm_s > 0):
            raise OutOfRange(f"{position_mm:g} mm at {speed_mm_s:g} mm/s; expected 0 to {self.settings.stroke_mm:g} mm")
        self._ready(force_n)
        speed = max(1, round(speed_mm_s / self.settings.mm_per_count))
        most = self.settings.units(force_n - self.settings.weight_n + self.settings.friction_n)
        most = min(most, self.settings.units(self._state.limit_n - self.settings.weight_n))
        target = self._go(position_mm, speed, most)
        self._acknowledged()
        self._set((_CONTROL, _ON))
        self._confirm = [(_LARGEST_DOWN, most), (_TARGET, target)]

    def push(self, force_n: float) -> None:
        """Press with a force, from now on [N].

        Raises
        ------
        OutOfRange
            A force above the limit.
        """
        self._ready(force_n)
        state, settings = self._state, self.settings
        if force_n != state.wanted_n:
            state.direction = 1 if force_n > state.wanted_n else -1
        state.wanted_n = force_n
        most = settings.units(state.limit_n - settings.weight_n)
        motor_n = force_n - settings.weight_n + state.direction * settings.friction_n
        target = min(most, round(motor_n / settings.newton_per_unit))
        if state.mode != _BY_FORCE or target != state.target:
            state.target, state.target_s = target, self._clock.now()
        if state.mode != _BY_FORCE:
            self._set((_LARGEST_DOWN, most), (_FORCE, target), (_MODE, _BY_FORCE))
            state.mode = _BY_FORCE
            self._confirm.append((_MODE_NOW, _BY_FORCE))
        else:
            self._set((_FORCE, target))
        self._confirm = [each for each in self._confirm if each[0] != _FORCE] + [(_FORCE, target)]

    def read(self) -> Extension:
        """Force and position now; set-points since the last call are asked for as well.

        Raises
        ------
        DeviceFault
            No answer, a fault bit, a motor that is off, a set-point that was not taken, or a current that does not
            follow.
        """
        begin = self._clock.now()
        self._feed(begin)
        confirm, self._confirm = self._confirm, []
        *back, units, count, status = self._ask(*(each for each, _ in confirm), _FORCE_NOW, _POSITION, _STATUS)
        time_s = (begin + self._clock.now()) / 2
        self._check(status)
        self._taken(confirm, back)
        self._follows(units, time_s)
        if self._state.homing_s is not None:
            self._home(status, time_s)
        position_mm = count * self.settings.mm_per_count if self._state.homed else self.settings.stroke_mm
        return Extension(time_s, self._force(units, count), position_mm)

    def _feed(self, now: float) -> None:
        """Set the watchdog's timer again; DeviceFault where it has lifted the piston."""
        if not self._watch_s or not self._state.on or now - self._fed_s < self._watch_s / _FEEDS:
            return
        self._set((_TIMER, round(1000 * self._watch_s)))
        if not self._ask(_WATCHES)[0]:
            seconds, self._watch_s = self._watch_s, 0.0
            raise DeviceFault(f"actuator at {self._port.address}: its watchdog lifted it, unread for {seconds:g} s")
        self._fed_s = now

    def lift(self) -> None:
        """Begin to go to the upper end, whatever was before, also on a line opened anew; nothing is asked.

        By position at 150 mm/s if the upper end is known and the motor on, otherwise by a force of 1 N beyond weight
        and friction, after a reset of an error.
        """
        self._confirm = []
        self._state.wanted_n, self._state.lifting = 0.0, True
        if self._state.homed and self._state.on:
            self._set((_CONTROL, _ON))
            self._go(0.0, _LIFT)
            self._set((_CONTROL, _ON))
            return
        self._set(*_raising(self.settings))
        state = self._state
        state.on, state.mode, state.homing_s = True, _BY_FORCE, None
        state.target, state.target_s = self.settings.lifting(), self._clock.now()

    def off(self) -> None:
        """Switch the motor off."""
        if self._watch_s:
            self._set((_WATCHES, 0))
        self._set((_CONTROL, _OFF), node=0)
        self._state.on = self._state.lifting = False
        self._state.homing_s = None

    def close(self) -> None:
        """Give the line back."""
        self._port.close()

    def _ready(self, force_n: float) -> None:
        if not force_n <= self._state.limit_n:
            raise OutOfRange(f"force {force_n:g} N; the limit is {self._state.limit_n:g} N")
        if not (self._state.homed and self._state.on):
            raise DeviceFault(f"actuator at {self._port.address} has not found its upper end; wait, or start it again")
        self._state.lifting = False

    def _go(self, position_mm: float, speed: int, most: int | None = None) -> int:
        """Begin a move to a position, which is given back in counts; the control word is 15 before and after."""
        target = round(position_mm / self.settings.mm_per_count)
        limit = [] if most is None else [(_LARGEST_DOWN, most)]
        mode = [] if self._state.mode == _BY_POSITION else [(_MODE, _BY_POSITION)]
        self._set(*limit, (_SPEED, speed), (_TARGET, target), *mode, (_CONTROL, _NEW))
        self._state.mode = _BY_POSITION
        return target

    def _acknowledged(self) -> None:
        """Refuse a target that the trajectory generator has not taken."""
        for _ in range(_TRIES):
            (status,) = self._ask(_STATUS)
            self._check(status)
            if status & _ACKNOWLEDGED:
                return
        raise DeviceFault(
            f"actuator at {self._port.address} did not take a target position: status word 0x{status:04X}"
        )

    def _check(self, status: int) -> None:
        """Refuse a fault, and a motor that is off without having been switched off."""
        state = self._state
        if status & _FAULT:
            state.on = False
            (code,) = self._ask(_ERROR)
            state.homed &= code not in _ENCODER
            raise _Reported(f"actuator at {self._port.address} {_named(code)}")
        if state.on and status & _STATE != _ENABLED:
            state.on = state.homed = False
            raise DeviceFault(f"actuator at {self._port.address} is off by itself: status word 0x{status:04X}")

    def _taken(self, wanted: Iterable[tuple[int, int]], values: Iterable[int]) -> None:
        for (what, value), answer in zip(wanted, values, strict=True):
            if answer != value:
                raise DeviceFault(
                    f"actuator at {self._port.address} did not take object 0x{what:X}: set {value}, now {answer}"
                )

    def _configure(self, pairs: list[tuple[int, int]]) -> None:
        """Set values a few at a time, and see that they were taken."""
        for begin in range(0, len(pairs), _BURST):
            some = pairs[begin : begin + _BURST]
            self._set(*some)
            self._taken(some, self._ask(*(what for what, _ in some)))

    def _follows(self, units: int, time_s: float) -> None:
        """Refuse a current that is not what was set."""
        state = self._state
        settled = state.on and state.mode == _BY_FORCE and time_s - state.target_s > _SETTLED_S
        if settled and abs(units - state.target) > _STRAY:
            raise DeviceFault(
                f"force of the actuator at {self._port.address} does not follow: set {state.target}, measured {units}"
                " per mille of the rated current"
            )

    def _home(self, status: int, time_s: float) -> None:
        """Follow the homing to its end."""
        state = self._state
        if state.homing_s is None or time_s - state.homing_s < _STATUS_S:
            return
        if status & _FAILED:
            state.homing_s = None
            raise DeviceFault(f"actuator at {self._port.address} does not find its upper end; is the stroke free?")
        if status & _REACHED and status & _ACKNOWLEDGED:  # target reached, homing attained
            state.homing_s, state.homed = None, True
            self._set((_CONTROL, _ON))
            self._go(0.0, _LIFT)
            self._set((_CONTROL, _ON))

    def _force(self, units: int, count: int) -> float:
        """Force on the object [N]."""
        state = self._state
        if abs(count - state.count) >= 2:
            state.direction = 1 if count > state.count else -1
            state.count = count
        return (
            units * self.settings.newton_per_unit + self.settings.weight_n - state.direction * self.settings.friction_n
        )

    def _set(self, *pairs: tuple[int, int], node: int | None = None) -> None:
        to = self.settings.node if node is None else node
        self._port.write(b"".join(b"%d W 0x%X %d\r" % (to, what, value) for what, value in pairs))

    def _ask(self, *objects: int) -> list[int]:
        """Values of objects, asked for in one message; after three failures the motor is switched off."""
        question = b"".join(b"%d R 0x%X\r" % (self.settings.node, each) for each in objects)
        for attempt in range(_TRIES):
            try:
                self._port.write(question)
                return [self._answer(each) for each in objects]
            except _Reported:
                self._state.on = False
                raise
            except DeviceFault as fault:
                if attempt == _TRIES - 1:
                    raise self._given_up(fault) from None
                self._quiet()
        raise AssertionError

    def _given_up(self, fault: DeviceFault) -> DeviceFault:
        """Motor off, unless it is lifting, or it is unknown what would receive that."""
        if self._state.lifting or not self._state.known:
            return fault if self._state.lifting else DeviceFault(f"{fault}; expected an LCC-10")
        with suppress(DeviceFault):
            self.off()
        return DeviceFault(f"{fault}; motor off was sent")

    def _quiet(self) -> None:
        """Drop what is still on the line, late answers too."""
        for _ in range(20):
            if not self._port.read_until(b"\r", self.settings.timeout_s):
                return

    def _answer(self, wanted: int) -> int:
        """The value of one object; status words that come unasked are passed over, errors raised."""
        asked = f"{self._port.address}, asked for object 0x{wanted:X},"
        for _ in range(10):
            line = self._port.read_until(b"\r", self.settings.timeout_s)
            if not line:
                raise DeviceFault(f"{asked} does not answer; check cable and power")
            what, value = _parsed(line, asked)
            if what == _EMERGENCY:
                raise _Reported(f"actuator at {self._port.address} {_named(value)}")
            if what == wanted:
                return value
            if what != _STATUS:
                raise DeviceFault(f"{asked} answers for 0x{what:X}: {line!r:.60}")
        raise DeviceFault(f"{asked} sends status words only")


def _raising(settings: Settings) -> list[tuple[int, int]]:
    """Error reset, motor on, and force upwards; switching on clears the set-points, so that the force comes last."""
    words = [(_CONTROL, word) for word in (_OFF, _RESET, _OFF, _READY, _ON)]
    return [(_MODE, _BY_FORCE), *words, (_FORCE, settings.lifting())]


def _command(what: int, value: int) -> int:
    """Command of a macro that sets an object: sub-index, index, bytes of the value, value."""
    return (what >> 16) << 56 | (what & 0xFFFF) << 40 | _BYTES[what] << 36 | value % (1 << 8 * _BYTES[what])


def _parsed(line: bytes, asked: str) -> tuple[int, int]:
    """Object and value of an answer, decimal or hexadecimal."""
    words = line.split()
    if not line.endswith(b"\r"):
        raise DeviceFault(f"{asked} sends {line!r:.60}, which does not end")
    if len(words) == 3 and words[1] == b"R":
        raise DeviceFault(f"{asked} sends its question back: {line!r:.60}; an echo, or transmit and receive are joined")
    try:
        _, letter, name, number = words
        what, value = _number(name), _number(number)
    except ValueError:
        letter = b""
    if letter != b"W":
        raise DeviceFault(f"{asked} answers {line!r:.60}; expected 0x20 W OBJECT VALUE")
    bits = _SIGNED.get(what, 0)
    return what, value - (1 << bits) if bits and value >= 1 << (bits - 1) else value


def _number(text: bytes) -> int:
    return int(text, 16 if text[:2].lower() == b"0x" else 10)


def _named(code: int) -> str:
    name = _ERRORS.get(code & 0xFFFF, "see SMAC's note Reset Error")
    return f"reports error 0x{code & 0xFFFF:04X} ({name})"
