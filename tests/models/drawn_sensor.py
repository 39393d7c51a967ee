"""The sensor of a drawing by closed-form models: what tests of lines, identifiability and inversion start from."""

from math import inf

from sensorgen.models.sensor import UNIFORM
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import FLAT, TIP_M, Tip
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import build_sensor


def sensor_of(design, law="", tip_m=TIP_M, *, profile=UNIFORM, radius_m=None, block=FLAT.block):
    body = drawn(design)
    return build_sensor(body, law, Tip(tip_m, profile, radius_m, block), rest=rest_state(body, inf))
