"""A second process that lifts the tip when the run dies or hangs.

The run sends it signs of life through a pipe. When the pipe closes, as it does however the run dies, or when no sign
comes for the dead man's time, it ends the run for good, opens the lines of actuator and stage anew, lifts both, and
switches the motor off. It has a session of its own, so that what ends the run's terminal does not end it. It tells the
run that it lives; when it dies, the run notices, lifts the tip, and ends.

As a program, ``python -m sensorgen.measure.lab.guardian`` takes its orders as the first line of its input, as JSON.
"""

import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import IO, Any, cast

from sensorgen.core.errors import SensorgenError
from sensorgen.core.records import Strict
from sensorgen.measure.lab import rigs
from sensorgen.measure.lab.devices import DeviceFault, RealClock
from sensorgen.measure.lab.experiment import Device

REPORT = "guardian.jsonl"
_ARM, _BEAT, _RELEASE, _ALIVE = b"A", b".", b"R", b"+"
_TELL_S, _DEAF_S, _BEGIN_S = 0.2, 3.0, 30.0  # from one sign of the guardian to the next, until it is missed, to begin
_TRIES_S, _AGAIN_S = 10.0, 0.1  # for which a call that fails is tried again, and how often
_RAISED, _REFUSED = "raised", 2
_UP_S, _RAISE_S = 1.5, 20.0  # that the piston, and the stage after a move that goes on, take at most
_STALL = 2.0  # of the guardian itself, in its own periods: a stalled judge judges nobody


class Orders(Strict):
    """Orders of a guardian.

    Attributes
    ----------
    devices : dict of str to Device
        "actuator" and "stage", those that have a line that can be opened anew.
    dead_man_s : float
        Without a sign of life for this long the run counts as hung [s].
    folder : str
        Of the run, for its report.
    """

    devices: dict[str, Device]
    dead_man_s: float
    folder: str


class Guardian(AbstractContextManager["Guardian", None]):
    """The guardian as its run sees it; use it in a ``with`` statement.

    Parameters
    ----------
    orders : Orders
        What to do.

    Raises
    ------
    DeviceFault
        It does not start.
    """

    def __init__(self, orders: Orders) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "sensorgen.measure.lab.guardian"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            bufsize=0, start_new_session=True,
        )  # fmt: skip
        self._pipes = cast(IO[bytes], self._process.stdin), cast(IO[bytes], self._process.stdout)
        self._to, self._from = (pipe.fileno() for pipe in self._pipes)
        self._heard_s, self._armed = time.monotonic(), False
        try:
            os.write(self._to, orders.model_dump_json().encode() + b"\n")
            if not select.select([self._from], [], [], _BEGIN_S)[0] or not os.read(self._from, 1):
                raise DeviceFault("guardian: it does not start")
        except BaseException as error:
            self._process.kill()
            self._process.wait()
            if isinstance(error, OSError):
                raise DeviceFault(f"guardian: it does not start: {error.strerror}") from None
            raise
        os.set_blocking(self._to, False)
        os.set_blocking(self._from, False)

    def __exit__(self, *_: object) -> None:
        self.close()

    def arm(self) -> None:
        """From now on it lifts the tip when the signs of life end."""
        self._send(_ARM)
        self._armed = True

    def disarm(self) -> None:
        """The tip is up by the run's own doing. Never raises."""
        self._armed = False
        with suppress(DeviceFault):
            self._send(_RELEASE)

    def beat(self) -> None:
        """A sign of life; DeviceFault where the guardian gives none itself."""
        self._send(_BEAT)
        now = time.monotonic()
        with suppress(BlockingIOError):
            if os.read(self._from, 4096):
                self._heard_s = now
            else:
                raise DeviceFault("guardian: it has died")
        if now - self._heard_s > _DEAF_S:
            raise DeviceFault(f"guardian: no sign of life for {_DEAF_S:g} s")

    def close(self) -> None:
        """End it; one that is still armed lifts the tip first. Never raises."""
        with suppress(OSError):
            self._pipes[0].close()
        try:
            self._process.wait(_TRIES_S + _RAISE_S + 2 * _DEAF_S if self._armed else _DEAF_S)
        except subprocess.TimeoutExpired:  # hung: it must not wake up later and lift by itself
            self._process.kill()
            self._process.wait()
        self._pipes[1].close()

    def _send(self, sign: bytes) -> None:
        try:
            os.write(self._to, sign)
        except OSError as error:
            raise DeviceFault(f"guardian: it has died or hangs ({error.strerror})") from None


def watch(orders: Orders, run: int) -> str:
    """Wait for signs of life on the standard input until they end; why the tip has to be lifted, or "".

    Parameters
    ----------
    orders : Orders
        What to do.
    run : int
        Number of the run's process; it is killed when it hangs, so that it does not wake up and press.
    """
    armed, last, told, looked = False, time.monotonic(), 0.0, time.monotonic()
    period = min(_TELL_S, orders.dead_man_s / 4)
    while True:
        ready = bool(select.select([0], [], [], period)[0])
        now = time.monotonic()
        signs = os.read(0, 4096) if ready else b""
        if ready and not signs:
            return "the run has died" if armed else ""
        if _RELEASE in signs:
            return ""
        armed |= _ARM in signs
        if signs or now - looked > _STALL * period + period:
            last = now
        looked = now
        if armed and now - last > orders.dead_man_s:
            if os.getppid() == run:
                os.kill(run, signal.SIGKILL)
            return f"the run has given no sign of life for {now - last:.2f} s and was killed"
        if now - told > _TELL_S:
            told = now
            with suppress(OSError):
                os.write(1, _ALIVE)


class Rescue:
    """Lift by actuator and stage at once, neither waiting for the other; the motor goes off when the stage is up.

    Without the stage raised a piston whose weight exceeds its friction would fall again: then its motor stays on.

    Parameters
    ----------
    devices : mapping of str to Device
        "actuator" and "stage".
    """

    def __init__(self, devices: Mapping[str, Device]) -> None:
        self._devices, self._clock = devices, RealClock()
        self._ended = threading.Event()  # of the stage's part
        self.outcome = dict.fromkeys(devices, "no answer")

    def run(self) -> None:
        """Return when both are done, or the time is over; ``outcome`` says what became of each."""
        ways = {"actuator": self._actuator, "stage": self._stage}
        threads = [
            threading.Thread(target=ways[role], args=(each,), daemon=True) for role, each in self._devices.items()
        ]
        for thread in threads:
            thread.start()
        until = time.monotonic() + _TRIES_S + _RAISE_S + _DEAF_S
        for thread in threads:
            thread.join(max(0.0, until - time.monotonic()))

    def _actuator(self, device: Device) -> None:
        driver = self._opened("actuator", device)
        if driver is None or not self._tried("actuator", driver.lift):
            return
        self.outcome["actuator"] = "lifted, motor on"
        time.sleep(_UP_S)
        self._ended.wait(2 * _TRIES_S + _RAISE_S)
        if self.outcome.get("stage") == _RAISED and self._tried("actuator", driver.off):
            self.outcome["actuator"] = "lifted, motor off"

    def _stage(self, device: Device) -> None:
        try:
            driver = self._opened("stage", device)
            if driver is not None and self._tried("stage", driver.identify) and self._tried("stage", driver.lift):
                self._raise(driver)
        finally:
            self._ended.set()

    def _raise(self, driver: Any) -> None:
        """Follow the stage up; one that refuses, as before it has its zero, is asked once more."""
        self.outcome["stage"] = "not raised in time"
        until, refused = time.monotonic() + _RAISE_S, 0
        while time.monotonic() < until and refused < _REFUSED:
            time.sleep(_AGAIN_S)
            try:
                if not driver.read().moving:
                    self.outcome["stage"] = _RAISED
                    return
            except SensorgenError as error:
                self.outcome["stage"] = str(error)
                refused += 1
                self._tried("stage", driver.lift)

    def _opened(self, role: str, device: Device) -> Any:
        """A driver on a line that is opened anew; None where it cannot be in time, as while a dying run has it."""
        drivers: list[Any] = []
        self._tried(role, lambda: drivers.append(rigs.opened(device, self._clock)))
        return drivers[0] if drivers else None

    def _tried(self, role: str, call: Callable[[], object]) -> bool:
        """Test whether a call worked, tried again until the time is over."""
        until = time.monotonic() + _TRIES_S
        while True:
            try:
                call()
            except (SensorgenError, OSError) as error:
                self.outcome[role] = str(error)
                if time.monotonic() > until:
                    return False
                time.sleep(_AGAIN_S)
            else:
                return True


def main() -> None:
    """Take orders, watch, and lift if need be."""
    run = os.getppid()
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if number := getattr(signal, name, None):
            signal.signal(number, signal.SIG_IGN)
    text = b""
    while not text.endswith(b"\n") and (more := os.read(0, 1)):  # the first line of the input, and no byte more
        text += more
    orders = Orders.model_validate_json(text)
    rigs.check(orders.devices)  # imports the drivers, so that nothing has to be imported when it counts
    os.write(1, _ALIVE)
    os.set_blocking(1, False)
    reason = watch(orders, run)
    if reason:
        begun, rescue = time.monotonic(), Rescue(orders.devices)
        rescue.run()
        took = round(time.monotonic() - begun, 3)
        done = {"at": round(time.time(), 3), "reason": reason, "devices": rescue.outcome, "took_s": took}
        with suppress(OSError), (Path(orders.folder) / REPORT).open("a", encoding="utf-8") as file:
            file.write(json.dumps(done) + "\n")


if __name__ == "__main__":
    main()
