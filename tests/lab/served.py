"""A simulated rig in a process of its own: controllers on pseudo-terminals, an impedance meter on a socket, real clock.

As a program it prints the addresses as JSON, then answers each line of its input with the state of the mechanism.
"""

import json
import sys
from contextlib import ExitStack
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import serving
from laboratory import LIMIT_N, specimen

from sensorgen.measure.lab.devices import RealClock
from sensorgen.measure.virtual import mechanics, reprap
from sensorgen.measure.virtual.reprap import RepRapFirmware
from sensorgen.measure.virtual.scpi import SimulatedLcrMeter
from sensorgen.measure.virtual.smac import SmacController


def main() -> None:
    reprap._HOMING_MM_S = 200.0  # so that a run begins to press sooner
    clock = RealClock()
    at = mechanics.VirtualRig(specimen(), mechanics.Mechanics(force_limit_n=LIMIT_N), time_s=clock.now())
    actuator, stage, meter = SmacController(at), RepRapFirmware(at), SimulatedLcrMeter(at, "hp-4284a")
    with ExitStack() as stack:
        places = {
            "actuator": stack.enter_context(serving.pseudo_terminal(actuator, clock)),
            "stage": stack.enter_context(serving.pseudo_terminal(stage, clock)),
            "impedance": stack.enter_context(serving.tcp_server(meter, clock)),
        }
        print(json.dumps(places), flush=True)
        for _ in sys.stdin:
            with serving._TURN:
                at.advance(clock.now())
                state = {
                    "at": clock.now(), "tip_mm": at.tip_mm, "force_n": at.force_n, "motor_n": at.motor_n,
                    "extension_mm": at.extension_mm, "peak_n": at.peak_n,
                    "violations": [[each.what, each.value, each.duration_s] for each in at.violations],
                    "heard": {"actuator": len(actuator.heard), "stage": len(stage.heard)},
                    "first": [bytes(line).decode("latin-1") for line in [*actuator.heard[:4], *stage.heard[:2]]],
                }  # fmt: skip
            print(json.dumps(state), flush=True)


if __name__ == "__main__":
    main()
