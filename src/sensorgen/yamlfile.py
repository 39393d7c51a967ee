"""YAML from people we do not know: plain data only, small, without aliases."""

from pathlib import Path
from typing import Any

import yaml

from sensorgen.errors import BadInput

MAX_BYTES = 1_000_000  # a design is a few hundred bytes; a megabyte is a mistake or an attack
MAX_DEPTH = 20


def read(path: Path) -> dict[str, Any]:
    """Read a mapping from a YAML file.

    Tags that name Python objects are refused by the safe loader. Aliases are refused altogether: a
    few lines of them expand to gigabytes, and no file of ours needs one.

    Raises
    ------
    BadInput
        Unreadable, over ``MAX_BYTES``, not UTF-8, not YAML, too deep, or not a mapping.
    """
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise BadInput(f"{path}: {size} bytes; expected at most {MAX_BYTES}: is this the right file?")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: not UTF-8 at byte {error.start}: save it as UTF-8 text") from None
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    return parse(text, str(path))


def parse(text: str, where: str) -> dict[str, Any]:
    """Parse a YAML mapping; ``where`` names its file in errors (see :func:`read`)."""
    try:
        _refuse_tricks(text, where)
        data = yaml.load(text, Loader=_Loader)  # noqa: S506 - _Loader is a safe loader
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise BadInput(f"{where}: {place}{error.problem}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise BadInput(f"{where}: not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict):
        raise BadInput(f"{where}: holds {type(data).__name__}; expected a mapping of names to values")
    return data


def _refuse_tricks(text: str, where: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.AliasEvent):
            raise BadInput(f"{where}: line {event.start_mark.line + 1}: aliases (*name) are not taken: write the value out")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > MAX_DEPTH:
            raise BadInput(f"{where}: nested deeper than {MAX_DEPTH} levels")


class _Loader(yaml.SafeLoader):
    """The safe loader, refusing a key given twice: YAML would silently keep the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if key.value in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key.value!r} is given twice", key.start_mark)
            if isinstance(key.value, str):
                seen.add(key.value)
        return super().construct_mapping(node, deep)
