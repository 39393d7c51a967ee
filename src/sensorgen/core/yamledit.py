"""Values in a YAML text changed in place: comments, order, quotes and line ends of everything else stay."""

import json
import re
from collections.abc import Mapping, Sequence

import yaml

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput

Value = float | str
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./@-]*")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off"}  # that some reader of YAML takes for no text


def changed(text: str, values: Mapping[tuple[str, ...], Value], where: str) -> str:
    r"""The text with some values replaced or added.

    Parameters
    ----------
    text : str
        Of a mapping, as :func:`sensorgen.core.yamlfile.parse` takes it.
    values : mapping
        Path of keys to the new value.
    where : str
        Name of the file in errors.

    Raises
    ------
    BadInput
        Not such a text, or one in which a value cannot be replaced alone.

    Examples
    --------
    >>> changed("shape: tri  # mine\nparameters: {period_mm: 2}\n", {("parameters", "period_mm"): 2.64}, "a.yaml")
    'shape: tri  # mine\nparameters: {period_mm: 2.64}\n'
    """
    wanted = yamlfile.parse(text, where)
    for path, value in values.items():
        text = _set(text, path, value, where)
        at = wanted
        for key in path[:-1]:
            at = at.setdefault(key, {})
        at[path[-1]] = value
    if yamlfile.parse(text, where) != wanted:
        raise BadInput(f"{where}: {', '.join('.'.join(p) for p in values)} cannot be changed in place: edit it by hand")
    return text


def _set(text: str, path: Sequence[str], value: Value, where: str) -> str:
    node = yaml.compose(text, Loader=yaml.SafeLoader)
    for depth, key in enumerate(path):
        if not isinstance(node, yaml.MappingNode):
            raise BadInput(f"{where}: {'.'.join(path[:depth])} is no mapping; expected one to put {key} into")
        inner = next((v for k, v in node.value if k.value == key), None)
        if inner is None:
            return _added(text, node, path[depth:], value)
        node = inner
    if not isinstance(node, yaml.ScalarNode):
        raise BadInput(f"{where}: {'.'.join(path)} is a list or a mapping; expected one value")
    start, end = node.start_mark.index, node.end_mark.index
    space = " " if start == end else ""  # nothing there, as in "key:"
    return text[:start] + space + _scalar(value) + text[end:]


def _added(text: str, node: yaml.MappingNode, path: Sequence[str], value: Value) -> str:
    """The text with a new key after the last one of a mapping."""
    if node.flow_style:
        inside = "".join(f"{key}: {{" for key in path[:-1]) + f"{path[-1]}: {_scalar(value)}" + "}" * (len(path) - 1)
        end = node.end_mark.index - 1
        last = node.value[-1][1].end_mark.index if node.value else end
        return text[:last] + (", " if node.value else "") + inside + text[last:]
    newline, indent, end = "\r\n" if "\r\n" in text else "\n", node.start_mark.column, _end(node)
    at = text.find("\n", end - 1 if text[:end].endswith("\n") else end)
    before, after = (text + newline, "") if at < 0 else (text[: at + 1], text[at + 1 :])
    lines = [f"{' ' * (indent + 2 * k)}{key}:" for k, key in enumerate(path)]
    lines[-1] += f" {_scalar(value)}"
    return before + "".join(line + newline for line in lines) + after


def _end(node: yaml.Node) -> int:
    """Place where the last value of a block ends: its own mark comes after comments that follow it."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        entry = node.value[-1]
        node = entry[1] if isinstance(entry, tuple) else entry
    return int(node.end_mark.index)


def _scalar(value: Value) -> str:
    if isinstance(value, float):
        return f"{value:.9g}"
    return value if _PLAIN.fullmatch(value) and value.lower() not in _WORDS else json.dumps(value)
