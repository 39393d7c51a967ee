"""sensorgen: from one design to a printable elastomer sensor, its prediction and its report.

Names are imported when they are first used.

>>> import sensorgen as sg
>>> p = sg.predict(sg.Design(shape="reference"))
>>> round(p.drawn.capacitance.value * 1e12, 2)  # pF
69.06
"""

import sys

if (
    sys.argv[:1] == ["-m"]
    and not sys.flags.safe_path
    and any(arg.split(".")[0] == "sensorgen" for arg in sys.orig_argv)
):
    del sys.path[0]  # `python -m sensorgen` puts the working folder first, whose random.py is not Python's

from importlib import import_module
from typing import TYPE_CHECKING, Any

from sensorgen.core.version import __version__ as __version__

if TYPE_CHECKING:
    from sensorgen.core.bounds import Bounds as Bounds
    from sensorgen.design.body import Body as Body
    from sensorgen.design.design import Design as Design
    from sensorgen.measure.log import Log as Log
    from sensorgen.prediction.query import Query as Query
    from sensorgen.prediction.query import Tip as Tip
    from sensorgen.prediction.results import Prediction as Prediction
    from sensorgen.workflows.api import *  # noqa: F403 - all functions there, by the names below

_TYPES = {
    "Body": "design.body",
    "Bounds": "core.bounds",
    "Design": "design.design",
    "Log": "measure.log",
    "Prediction": "prediction.results",
    "Query": "prediction.query",
    "Tip": "prediction.query",
}
_FUNCTIONS = (
    "as_printed",
    "batch",
    "build",
    "calibrate",
    "cell",
    "characterise",
    "check",
    "compare",
    "compress",
    "export_design",
    "fit",
    "invert",
    "load",
    "optimise",
    "predict",
    "report",
    "show",
    "slice_design",
    "sweep",
)

__all__ = [*_TYPES, *_FUNCTIONS]


def __getattr__(name: str) -> Any:
    if name in _TYPES:
        import_module("sensorgen.workflows.display")  # how they show themselves in a notebook
        return getattr(import_module(f"sensorgen.{_TYPES[name]}"), name)
    if name in _FUNCTIONS:
        return getattr(import_module("sensorgen.workflows.api"), name)
    raise AttributeError(f"module 'sensorgen' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
