"""Simulated RepRapFirmware 3 on a plant: G-code over a serial line, and the requests of its HTTP interface.

Written from the firmware's public documentation and source, but without the driver.
"""

import json
import re
import urllib.parse
from collections import deque

from sensorgen.measure.virtual.plant import Plant, Simulator

_SESSION_S, _QUEUE, _BUFFER = 8.0, 40, 1024
_HOMING_MM_S = 20.0
_WORDS = re.compile(r"([A-Z])(-?[0-9.]*)")
_KEY = re.compile(r'K"([^"]*)"')


class RepRapFirmware(Simulator):
    """A Duet board with RepRapFirmware 3, asked by :meth:`exchange` over USB or by :meth:`get` over HTTP.

    Parameters
    ----------
    plant : Plant
        What it moves along x and z.
    password : str
        Of HTTP.

    Attributes
    ----------
    fault : str
        Planted fault, or "". ``silent``: no answers; ``hung``: no answers and no action;
        ``stuck``: moves are accepted and not carried out; ``error``: moves are refused with a message.
    heard : list of bytes
        Every line or request that has come.
    """

    GARBAGE = b"\x7f?<\nok\n"

    def __init__(self, plant: Plant, *, password: str = "reprap") -> None:  # noqa: S107
        super().__init__(plant)
        self._password = password
        self._lines: deque[tuple[str, str]] = deque()  # channel and code
        self._moves: deque[dict[str, tuple[float, float]]] = deque()
        self._replies: list[str] = []
        self._sequence = 0
        self._session_s: float | None = None
        self._absolute, self._homed, self._homing, self._halted = True, False, False, False
        self._goal = {"x": plant.axis("x")[0], "z": plant.axis("z")[0]}
        self._feed_mm_s = 50.0

    def get(self, path: str, time_s: float) -> tuple[int, bytes]:
        """Status and content of one request; TimeoutError where nothing answers."""
        if self.fault == "cut":
            raise OSError("no route to host")
        self._plant.advance(time_s)
        self.heard.append(path.encode())
        if self.fault == "hung":
            raise TimeoutError("timed out")
        url = urllib.parse.urlsplit(path)
        query = dict(urllib.parse.parse_qsl(url.query, keep_blank_values=True))
        status, text = self._request(url.path.removeprefix("/rr_"), query, time_s)
        self._step()
        if self.fault == "silent":
            raise TimeoutError("timed out")
        return status, self._spoilt(text.encode())

    def _request(self, name: str, query: dict[str, str], time_s: float) -> tuple[int, str]:
        if self.fault == "identity":
            return 404, "<html>Not Found</html>"
        if name == "connect":
            return 200, self._connect(query.get("password", ""), time_s)
        if self._session_s is None or time_s - self._session_s > _SESSION_S:
            return 401, "Not authorized"
        self._session_s = time_s
        if name == "disconnect":
            self._session_s = None
            return 200, '{"err":0}'
        answer = {"gcode": self._gcode, "reply": self._reply, "model": self._model}.get(name)
        return (200, answer(query)) if answer else (500, "Unknown request")

    def _connect(self, password: str, time_s: float) -> str:
        if password != self._password:
            return '{"err":1}'
        self._session_s = time_s
        return '{"err":0,"sessionTimeout":8000,"boardType":"duetwifi102","apiLevel":1}'

    def _gcode(self, query: dict[str, str]) -> str:
        """Put lines into the buffer of HTTP, all or none."""
        code = query.get("gcode", "")
        used = sum(len(each) + 1 for channel, each in self._lines if channel == "http")
        if used + len(code) > _BUFFER:
            return '{"err":1}'
        for line in code.split("\n"):
            self._accept(line.encode(), "http")
        return json.dumps({"buff": _BUFFER - used - len(code)})

    def _reply(self, _: dict[str, str]) -> str:
        replies, self._replies = self._replies, []
        return "".join(replies)

    def _model(self, query: dict[str, str]) -> str:
        axes = [{"machinePosition": each} for each in self._axes()]
        live = {"move": {"axes": axes}, "seqs": {"reply": self._sequence}, "state": {"status": self._status()}}
        return json.dumps({"key": "", "flags": query.get("flags", ""), "result": live})

    def _take(self, line: bytes) -> None:
        self._accept(line, "usb")

    def _accept(self, line: bytes, channel: str) -> None:
        """One line into the queue of its channel; M112 acts before anything else."""
        code = line.decode("ascii", "replace").partition(";")[0].strip()
        if code == "M112":
            self._emergency()
        else:
            self._lines.append((channel, code))

    def _emergency(self) -> None:
        for axis in ("x", "z"):
            self._plant.travel(axis, self._plant.axis(axis)[0], 1.0)
        self._lines.clear()
        self._moves.clear()
        self._halted, self._homed, self._homing = True, False, False

    def _step(self) -> None:
        """Carry out lines until one has to wait, then moves."""
        if self.fault == "hung":
            return
        self._go_on()
        while self._lines and not self._waits(self._lines[0][1]):
            channel, code = self._lines.popleft()
            self._answer(channel, self._execute(code))
            self._go_on()

    def _go_on(self) -> None:
        """Begin the next move of the queue when the one before has ended."""
        while self._moves and not self._moving():
            for axis, (position, speed) in self._moves.popleft().items():
                if self.fault != "stuck":
                    self._plant.travel(axis, position, speed)

    def _waits(self, code: str) -> bool:
        """Test whether a command cannot be carried out yet."""
        if code.startswith(("G1 ", "G0 ")):
            return len(self._moves) >= _QUEUE
        if code == "G28" and not self._homing and not self._busy():
            self._homing = True
            self._moves.append({"x": (0.0, _HOMING_MM_S)})
            self._moves.append({"z": (0.0, _HOMING_MM_S)})
            self._go_on()
        return code in ("G28", "M400") and self._busy()

    def _busy(self) -> bool:
        return bool(self._moves) or self._moving()

    def _moving(self) -> bool:
        return self._plant.axis("x")[1] or self._plant.axis("z")[1]

    def _status(self) -> str:
        return "halted" if self._halted else "busy" if self._busy() else "idle"

    def _axes(self) -> list[float]:
        return [round(self._plant.axis("x")[0], 3), 0.0, round(self._plant.axis("z")[0], 3)]

    def _execute(self, code: str) -> str:
        """Reply to one command that can be carried out now."""
        name = code.partition(" ")[0]
        if self._halted and name != "M999" and not name.startswith(("M4", "M1")):
            return ""
        if name in ("G0", "G1"):
            return self._move(code)
        if name in ("G90", "G91"):
            self._absolute = name == "G90"
        elif name == "G28":
            self._homed, self._homing = True, False
            self._goal = {"x": 0.0, "z": 0.0}
        elif name == "M999":
            self._halted = False
        return self._report(name, code)

    def _report(self, name: str, code: str) -> str:
        if name == "M115":
            firmware = "Marlin 2.1" if self.fault == "identity" else "RepRapFirmware for Duet 2 WiFi/Ethernet"
            board = "Duet WiFi 1.02 or later FIRMWARE_DATE: 2024-09-25"
            return f"FIRMWARE_NAME: {firmware} FIRMWARE_VERSION: 3.5.3 ELECTRONICS: {board}"
        if name == "M114":
            x, z = self._goal["x"], self._goal["z"]
            return f"X:{x:.3f} Y:0.000 Z:{z:.3f} E:0.000 Count 0 0 0 Machine {x:.3f} 0.000 {z:.3f} Bed comp 0.000"
        if name == "M409":
            key = match.group(1) if (match := _KEY.search(code)) else ""
            values = {"state.status": self._status(), "move.axes[].machinePosition": self._axes()}
            return json.dumps({"key": key, "flags": "", "result": values.get(key)}) + "\n"
        return "" if name[:1] in "GM" else f"Error: Bad command: {code}"

    def _move(self, code: str) -> str:
        """Put a move into the queue."""
        words = dict(_WORDS.findall(code.partition(" ")[2].upper()))
        if self.fault == "error" or (not self._homed and "H" not in words):
            return "Error: G1: insufficient axes homed"
        self._feed_mm_s = float(words["F"]) / 60 if "F" in words else self._feed_mm_s
        move = {}
        for axis in "xz":
            if axis.upper() in words:
                start = 0.0 if self._absolute else self._goal[axis]
                self._goal[axis] = start + float(words[axis.upper()])
                move[axis] = (self._goal[axis], self._feed_mm_s)
        self._moves.append(move)
        return ""

    def _answer(self, channel: str, reply: str) -> None:
        if channel == "http":
            self._replies.append(f"{reply}\n")
            self._sequence += 1
            return
        self._out += self._spoilt((f"{reply}\nok\n" if reply else "ok\n").encode())
