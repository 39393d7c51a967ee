"""Bars of a plate of coupons through the real PrusaSlicer: all their lines run along x, whichever way the bar lies."""

import re
from math import atan2, degrees, hypot

from sensorgen.export.slicers import prusa
from sensorgen.export.slicers.loads import loads
from sensorgen.workflows.characterise import Study, plate


def test_lines_of_bars_run_along_x(prusa_slicer, tmp_path):
    study = Study.of("diabase-h5", ["etpu", "x60"])
    coupons = [c for c in study.coupons if c.name in ("bar-45-0.8", "bar-90-0.8", "ladder-print-0.4")]
    places, names = plate.arranged(coupons, study.design), ("etpu", "x60")
    files = dict(plate.threemfs("bars", coupons, study.design, places, names))
    (tmp_path / "bars.3mf").write_bytes(files["bars.prusa.3mf"])
    (tmp_path / "bars.ini").write_text(prusa.profile(study.design.machine, study.design.layers, loads(study.design)))
    prusa.slice_3mf(tmp_path / "bars.3mf", tmp_path / "bars.ini", tmp_path / "bars.gcode")
    x = y = z = 0.0
    length: dict[tuple[int, bool], float] = {}
    for line in (tmp_path / "bars.gcode").read_text().splitlines():
        if not line.startswith("G1 "):
            continue
        words = {w[0]: float(w[1:]) for w in re.findall(r"[XYZE]-?[0-9.]+", line.partition(";")[0])}
        z, to = words.get("Z", z), (words.get("X", x), words.get("Y", y))
        step = hypot(to[0] - x, to[1] - y)
        if words.get("E", 0.0) > 0 and step > 3.0 and z > 0.15:
            along = degrees(atan2(to[1] - y, to[0] - x)) % 180 in (0.0, 180.0) or abs(to[1] - y) < 0.02
            for k, place in places.items():
                if place.x0 <= x <= place.x1 and place.y0 <= y <= place.y1:
                    length[k, along] = length.get((k, along), 0.0) + step
        x, y = to
    shares = [length[k, True] / (length[k, True] + length.get((k, False), 0.0)) for k in range(3)]
    assert [c.degrees for c in coupons] == [45.0, 90.0, None]
    assert min(shares[:2]) > 0.98
    assert shares[2] < 0.6  # as the profile lays them: walls, and infill at an angle that turns from layer to layer
