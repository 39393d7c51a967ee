"""Simulated LCC-10 controller of a SMAC actuator: the same bytes as SMAC's notes give, on a plant.

Written from the public notes that the driver names, but without the driver.
"""

from math import inf

from sensorgen.measure.virtual.plant import Plant, Simulator

_SIGNED = {
    0x6071: 16, 0x6077: 16, 0x60E0: 16, 0x60E1: 16, 0x607A: 32, 0x6064: 32, 0x60F4: 32, 0x6061: 8, 0x6098: 8,
    0x607C: 32,
}  # fmt: skip
_SWITCHED = {6: 0x21, 7: 0x23, 15: 0x27}  # status by control word
_FROM = {7: (0x21, 0x23, 0x27), 15: (0x23, 0x27)}  # states from which a control word is obeyed
_HOMED_MM, _REACHED_MM = 0.02, 0.02


class SmacController(Simulator):
    """An LCC-10, asked by :meth:`exchange`.

    Parameters
    ----------
    plant : Plant
        What it moves.
    newton_per_unit, mm_per_count : float
        Of motor and encoder [N], [mm].

    Attributes
    ----------
    fault : str
        Planted fault, or "". ``silent``: no answers; ``hung``: no answers and no action;
        ``stuck``: set-points are stored and ignored; ``runaway``: the motor goes to the largest force allowed;
        ``error``: it reports too high a current once.
    heard : list of bytes
        Every line that has come.
    """

    END, GARBAGE = b"\r", b"\xfe?~0x2\r"

    def __init__(self, plant: Plant, *, newton_per_unit: float = 0.0167, mm_per_count: float = 0.005) -> None:
        super().__init__(plant)
        self._newton, self._mm = newton_per_unit, mm_per_count
        self._zero_mm = 0.0
        self._failed = False
        self._homing_s: float | None = None
        self._told = 0
        self._macros: dict[tuple[int, int], int] = {}  # by number and command
        self._timer_s = inf  # when timer 3 reaches 0
        self._objects = {
            0x12C05: 0, 0x22C05: 0, 0x72C07: 0, 0x72C08: 0,
            0x1000: 0x00020192, 0x11018: 0x29C, 0x21018: 0x116, 0x31018: 0x20001, 0x41018: 4711, 0x1001: 0, 0x603F: 0,
            0x42000: 1, 0x52000: 1, 0x6040: 0, 0x6041: 0x40, 0x6060: 1, 0x6061: 1, 0x6071: 0, 0x6072: 1000,
            0x60E0: 1000, 0x60E1: -1000, 0x607A: 0, 0x6081: 30_000, 0x6083: 30_000, 0x6084: 30_000, 0x6087: 10_000,
            0x6098: -2, 0x16099: 50_000, 0x26099: 5000, 0x609A: 100_000, 0x12102: 8000, 0x22102: 200, 0x607C: 0,
        }  # fmt: skip

    def _step(self) -> None:
        """Step of the controller by itself."""
        if self.fault == "hung":
            return
        if self.fault == "error" and not self._failed:
            self._fail(0x2201)
        self._count_down()
        self._failed = self.fault == "error"
        if self._state() == 0x27 and self.fault == "runaway":
            self._plant.drive(self._bounded(1000) * self._newton)
        if self._homing_s is not None:
            self._home(self._homing_s)
        status = self._status()
        if self._objects[0x52000] and status != self._told:
            self._say(0x6041, status)
        self._told = status

    def _count_down(self) -> None:
        """Timer 3 and its interrupt, which calls a macro whose commands write objects."""
        if self._now_s < self._timer_s:
            return
        self._timer_s, macro = inf, self._objects[0x72C07] * self._objects[0x72C08]
        self._objects[0x72C08] = 0
        for number in range(64):
            code = self._macros.get((macro, number), 0)
            what, bits, value = code >> 40, 8 * (code >> 36 & 0xF), code & 0xFFFFFFFF
            if what in (0, 0x022C04):  # the end, return
                return
            self._write(what, value - (1 << bits) if what in _SIGNED and value >> (bits - 1) & 1 else value)

    def _home(self, begin_s: float) -> None:
        if self._plant.extension_mm <= _HOMED_MM and self.fault != "stuck":
            self._zero_mm, self._homing_s = 0.0, None
            self._objects[0x6041] |= 0x1400
        elif self._now_s - begin_s > self._objects[0x12102] / 1e3:
            self._homing_s = None
            self._objects[0x6041] |= 0x2000
            self._say(0x11003, 0x8613)

    def _fail(self, code: int) -> None:
        """An error: the motor goes off."""
        self._plant.switch(on=False)
        self._homing_s = None
        self._objects |= {0x603F: code, 0x1001: 0x80, 0x6041: 0x08}
        self._say(0x11003, code)

    def _state(self) -> int:
        return self._objects[0x6041] & 0x6F

    def _status(self) -> int:
        """Status word: state, and the bits of the mode."""
        word = self._objects[0x6041]
        if self._state() != 0x27 or self._objects[0x6061] == 6:
            return word
        word &= ~0x3400
        if self._objects[0x6061] == 1:
            off_mm = self._plant.extension_mm - self._zero_mm - self._objects[0x607A] * self._mm
            word |= 0x1000 if self._objects[0x6040] & 0x10 else 0
            word |= 0x0400 if abs(off_mm) <= _REACHED_MM else 0
        return word

    def _take(self, line: bytes) -> None:
        """Carry out one line; what is no command is passed over."""
        words = line.split()
        try:
            node, what = _number(words[0]), _number(words[2])
            value = _number(words[3]) if words[1] == b"W" else None
        except (IndexError, ValueError):
            return
        if node not in (0, 32):
            return
        if value is not None:
            self._write(what, value)
        elif self.fault == "echo":
            self._out += line + b"\r"
        else:
            self._say(what, self._read(what))

    def _read(self, what: int) -> int:
        if what == 0x11018 and self.fault == "identity":
            return 0x2E
        if what == 0x32C05:
            return self._macros.get((self._objects[0x12C05], self._objects[0x22C05]), 0xFFFFFFF1FFFFFFFF)
        if what == 0x6041:
            return self._status()
        if what == 0x6064:
            return round((self._plant.extension_mm - self._zero_mm) / self._mm)
        return round(self._plant.motor_n / self._newton) if what == 0x6077 else self._objects.get(what, 0)

    def _say(self, what: int, value: int) -> None:
        """One answer, as the planted fault has it."""
        if not self._objects[0x42000]:
            bits = _SIGNED.get(what, 32)
            line = b"0x20 W 0x%X 0x%X\r" % (what, value % (1 << bits))
        else:
            line = b"0x20 W 0x%X %d\r" % (what, value)
        self._out += self._spoilt(line)

    def _write(self, what: int, value: int) -> None:
        if what == 0x6040:
            self._control(value)
            return
        if what not in self._objects:
            self._program(what, value)
            return
        self._objects[what] = value
        if what == 0x6060:
            self._objects[0x6061] = value
        if what in (0x6060, 0x6071, 0x60E0, 0x60E1, 0x6072):
            self._plant.limit(self._objects[0x6072] * self._newton)
            self._drive()
        if what in (0x60E0, 0x60E1) and self._objects[0x6061] == 1:
            self._seek_again()

    def _program(self, what: int, value: int) -> None:
        """Macro memory and timer."""
        if what == 0x32C05:
            self._macros[self._objects[0x12C05], self._objects[0x22C05]] = value
        elif what == 0x32C06:
            self._timer_s = self._now_s + value / 1e3
        elif what == 0x42C04:
            self._macros = {key: code for key, code in self._macros.items() if key[0] != value}

    def _control(self, value: int) -> None:
        """Control word: state machine, and the bit that begins a move or homing."""
        risen, self._objects[0x6040] = value & ~self._objects[0x6040], value
        if self._state() == 0x08:
            if risen & 0x80:
                self._objects |= {0x6041: 0x40, 0x603F: 0, 0x1001: 0}
            return
        low = value & 0x0F
        if value & 0x80 or not value & 2:
            self._turn(0x40)
        elif low in _SWITCHED and self._state() in _FROM.get(low, (self._state(),)):
            self._turn(_SWITCHED[low])
        if self._state() == 0x27 and risen & 0x10:
            self._begin()

    def _turn(self, state: int) -> None:
        was = self._state()
        if state == was:
            return
        self._objects[0x6041] = state
        if state == 0x27:
            self._objects[0x6071] = 0  # set-points are cleared
            self._plant.switch(on=True)
            self._drive()
        elif was == 0x27:
            self._homing_s = None
            self._plant.switch(on=False)

    def _begin(self) -> None:
        """Bit 4 of the control word has risen."""
        if self._objects[0x6061] == 1:
            self._seek_again()
        elif self._objects[0x6061] == 6:
            self._homing_s = self._now_s
            self._objects[0x6041] &= ~0x3400
            if self.fault not in ("stuck", "runaway"):
                speed = self._objects[0x16099] * self._mm
                self._plant.seek(0.0, speed, self._objects[0x22102] * self._newton)

    def _bounded(self, units: int) -> int:
        down = min(self._objects[0x60E0], self._objects[0x6072])
        up = max(self._objects[0x60E1], -self._objects[0x6072])
        return max(up, min(down, units))

    def _drive(self) -> None:
        """Force mode."""
        if self._state() == 0x27 and self._objects[0x6061] == 4 and self.fault not in ("stuck", "runaway"):
            self._plant.drive(self._bounded(self._objects[0x6071]) * self._newton)

    def _seek_again(self) -> None:
        """Position mode."""
        if self._state() == 0x27 and self.fault not in ("stuck", "runaway"):
            target_mm = self._objects[0x607A] * self._mm + self._zero_mm
            self._plant.seek(target_mm, self._objects[0x6081] * self._mm, self._bounded(1000) * self._newton)


def _number(text: bytes) -> int:
    return int(text, 16 if text[:2].lower() == b"0x" else 10)
