"""What slicers say in comments: kind, width and height of the lines that follow, and the layer."""

import re
from collections.abc import Callable

# Quantities that hold until the next comment of their sort.
KIND, WIDTH, HEIGHT, LAYER, NEXT_LAYER = "kind", "width", "height", "layer", "next layer"

_LENGTH = re.compile(r"\s*([0-9]+\.?[0-9]*|\.[0-9]+)\s*(?:mm)?\s*")
_LAYER_AND_Z = re.compile(r"layer ([0-9]+), Z = ")
_TOOL_LINE = re.compile(r"tool H([0-9.]+) W([0-9.]+)")

Note = tuple[str, str | float]


def read(remark: str) -> list[Note]:
    """Quantities and values of one comment, without its semicolon.

    Parameters
    ----------
    remark : str
        The comment of PrusaSlicer, Cura, Orca, Bambu Studio or Simplify3D.

    Returns
    -------
    list of (str, str or float)
        Kind of line in lower case; width and height [mm]; layer from 1 at the bed [-]. Empty for any
        other comment.

    Examples
    --------
    >>> read("TYPE:External perimeter"), read("HEIGHT:0.1"), read("LAYER:0"), read(" thumbnail begin 16x16")
    ([('kind', 'external perimeter')], [('height', 0.1)], [('layer', 1.0)], [])
    """
    key, _, value = remark.partition(":")
    key = key.strip()
    if key in _KEYS:
        return _KEYS[key](value)
    return _simplify3d(remark.strip()) if key[:4] in ("feat", "laye", "tool") else []


def _length(quantity: str) -> Callable[[str], list[Note]]:
    def of(value: str) -> list[Note]:
        found = _LENGTH.fullmatch(value)
        return [(quantity, float(found[1]))] if found else []

    return of


def _kind(value: str) -> list[Note]:
    return [(KIND, value.strip().lower())]


def _numbered(value: str) -> list[Note]:
    text = value.strip()
    return [(LAYER, float(int(text) + 1))] if re.fullmatch(r"-?[0-9]{1,9}", text) else []


_KEYS: dict[str, Callable[[str], list[Note]]] = {
    "TYPE": _kind,
    "FEATURE": _kind,
    "WIDTH": _length(WIDTH),
    "LINE_WIDTH": _length(WIDTH),
    "HEIGHT": _length(HEIGHT),
    "LAYER_HEIGHT": _length(HEIGHT),
    "Layer height": _length(HEIGHT),
    "LAYER": _numbered,
    "LAYER_CHANGE": lambda _: [(NEXT_LAYER, 1.0)],
    "CHANGE_LAYER": lambda _: [(NEXT_LAYER, 1.0)],
}


def _simplify3d(remark: str) -> list[Note]:
    if remark.startswith("feature "):
        return _kind(remark.removeprefix("feature "))
    if found := _LAYER_AND_Z.match(remark):
        return [(LAYER, float(found[1]))]
    if found := _TOOL_LINE.fullmatch(remark):
        return [*_length(HEIGHT)(found[1]), *_length(WIDTH)(found[2])]
    return []
