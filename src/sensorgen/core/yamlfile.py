"""YAML files: plain data of strangers read safely, and single values changed in place."""

import json
import os
import re
import stat
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import yaml

from sensorgen.core.errors import BadInput

MAX_BYTES = 100_000  # a design is a few hundred bytes; a hundred kilobytes are a mistake or an attack
MAX_DEPTH = 20
_TEXT = "tag:yaml.org,2002:str"
_KINDS = {type(None): "nothing", list: "a list", str: "text", bool: "true or false", int: "a number", float: "a number"}


def read(path: Path) -> dict[str, Any]:
    """Read a mapping from a YAML file.

    Raises
    ------
    BadInput
        Unreadable, no regular file, over ``MAX_BYTES``, not UTF-8, or what :func:`parse` refuses.
    """
    return parse(text(path), str(path))


def text(path: Path) -> str:
    """Text of a small file.

    Raises
    ------
    BadInput
        Unreadable, no regular file, over ``MAX_BYTES``, or not UTF-8.
    """
    try:  # a pipe or device, which may never end, is not waited for
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise BadInput(f"{path}: not a file; expected a YAML file")
            if status.st_size > MAX_BYTES:
                raise BadInput(f"{path}: {status.st_size} bytes; expected at most {MAX_BYTES}: is this the right file?")
            return file.read(MAX_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: not UTF-8 at byte {error.start}: save it as UTF-8 text") from None
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None


def parse(text: str, where: str) -> dict[str, Any]:
    """Parse a YAML mapping; ``where`` names its file in errors.

    Only what is written so is a number (``1e-3`` too), a truth (``true``, ``false``) or nothing; ``no``, ``010``,
    ``1:30`` and dates stay text, unlike in YAML 1.1. Tags are refused, since they may name Python objects, and so
    are aliases: a few lines of them expand to gigabytes, and no file of ours needs one.

    >>> parse("{a: 1e-3, b: no, c: 010}", "example")
    {'a': 0.001, 'b': 'no', 'c': '010'}

    Raises
    ------
    BadInput
        Not YAML, too deep, a key given twice, or not a mapping; the message names line and column.
    """
    try:
        _refuse_tricks(text, where)
        data = yaml.load(text, Loader=_Loader)  # noqa: S506 - _Loader is a safe loader
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise BadInput(f"{where}: {place}{', '.join(filter(None, (error.context, error.problem)))}") from None
    except yaml.reader.ReaderError as error:
        shown = f"#x{error.character:04x}" if isinstance(error.character, int) else repr(error.character)
        raise BadInput(
            f"{where}: control character {shown} at position {error.position}; expected plain text"
        ) from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise BadInput(f"{where}: not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict):
        kind = _KINDS.get(type(data), "something else")
        raise BadInput(f"{where}: holds {kind}; expected a mapping of names to values")
    return data


def line(text: str, place: Iterable[str | int]) -> int:
    r"""Line of the value at a place of a text that :func:`parse` has read, or of the last part that is there.

    >>> line("a: 1\nb:\n  - {c: 2}\n  - {c: 3}\n", ("b", 1, "c"))
    4
    """
    node = yaml.compose(text, Loader=_Loader)
    for part in place:
        if isinstance(node, yaml.MappingNode):
            inner = next((value for key, value in node.value if key.value == part), None)
        else:
            inner = node.value[part] if isinstance(node, yaml.SequenceNode) and isinstance(part, int) else None
        if inner is None:
            break
        node = inner
    return int(node.start_mark.line) + 1 if node else 1


def _refuse_tricks(text: str, where: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        place = f"{where}: line {event.start_mark.line + 1}"  # type: ignore[union-attr]
        if isinstance(event, yaml.AliasEvent):
            raise BadInput(f"{place}: aliases (*name) are not taken: write the value out")
        if getattr(event, "tag", None):
            raise BadInput(f"{place}: tags (!name) are not taken: write plain values")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > MAX_DEPTH:
            raise BadInput(f"{place}: nested deeper than {MAX_DEPTH} levels")


_Fast: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Fast):  # type: ignore[misc,valid-type]
    """The safe loader, ten times faster in C, with fewer surprises: a key given twice is refused."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[tuple[str, re.Pattern[str]]]]] = {}

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if key.tag != _TEXT:
                shown = repr(key.value) if isinstance(key, yaml.ScalarNode) else "that is a list or a mapping"
                problem = f"key {shown}: expected text, a number in quotes"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            if key.value in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key.value!r} is given twice", key.start_mark)
            seen.add(key.value)
        return dict(super().construct_mapping(node, deep))


_FLOAT = r"[-+]?((0|[1-9][0-9]*)(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,4})?|[-+]?\.inf|\.nan"
for _kind, _pattern, _first in (  # as in YAML 1.2
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?(0|[1-9][0-9]{0,17})", list("-+0123456789")),
    ("float", _FLOAT, list("-+.0123456789")),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(f"(?:{_pattern})$"), _first)


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
    wanted = parse(text, where)
    for path, value in values.items():
        text = _set(text, path, value, where)
        at = wanted
        for key in path[:-1]:
            at = at.setdefault(key, {})
        at[path[-1]] = value
    if parse(text, where) != wanted:
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
