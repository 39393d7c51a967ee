"""Settings of a slicer where a design wants it otherwise than our profiles, down to settings of the user's own."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput
from sensorgen.core.records import Strict, stated

Slicer = Literal["prusa", "cura", "orca"]
Setting = str | int | float
_LINE = re.compile(r"\s*([A-Za-z0-9_]+)\s*=\s*(.*?)\s*")


class Profile(Strict):
    """Slicer settings of a design. What is not given is as in our profiles, from material, printer and quality."""

    walls: Literal["arachne", "classic"] | None = stated(
        None, "Lines of variable width, or of one width; classic walls drop what no line fits."
    )
    wall_lines: dict[str, Annotated[int, Field(ge=1, le=100)]] = stated(
        {}, "Material to the number of its walls' lines."
    )
    line_mm: dict[str, Annotated[float, Field(ge=0.05, le=5.0)]] = stated(
        {}, "Material to the width of its lines [mm]."
    )
    infill_angle_deg: dict[str, Annotated[float, Field(ge=0.0, lt=180.0)]] = stated(
        {}, "Material to the direction of its infill, from x [degree]."
    )
    own: dict[Slicer, str] = stated(
        {}, "Slicer to a file of settings (.ini, .json), relative to the design's own file."
    )
    settings: dict[Slicer, dict[str, Setting]] = stated(
        {}, "Slicer to its settings, which go before all others, those of the file too."
    )

    def materials(self) -> set[str]:
        """Materials that it names."""
        return {*self.wall_lines, *self.line_mm, *self.infill_angle_deg}

    def texts(self, slicer: Slicer) -> dict[str, str]:
        """The user's own settings for a slicer, as its profiles write them."""
        return {key: str(value) for key, value in self.settings.get(slicer, {}).items()}


def with_own(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's data with the content of its own settings files in place of their names.

    Parameters
    ----------
    data : dict
        Of a design, not validated yet; returned as it is where the validation is to refuse it.
    folder : Path
        What the names are relative to.

    Raises
    ------
    BadInput
        A file cannot be read, or holds no settings.
    """
    profile = data.get("profile")
    if not isinstance(profile, Mapping):
        return data
    own, inline = profile.get("own", {}), profile.get("settings", {})
    if not (isinstance(own, Mapping) and isinstance(inline, Mapping)):
        return data
    if not all(isinstance(n, str) for n in own.values()) or not all(isinstance(s, Mapping) for s in inline.values()):
        return data
    read = {slicer: settings_of(folder / name) for slicer, name in own.items()}
    both = {slicer: {**read.get(slicer, {}), **inline.get(slicer, {})} for slicer in {**read, **inline}}
    return {**data, "profile": {**profile, "own": {}, "settings": both}}


def settings_of(path: Path) -> dict[str, Setting]:
    """Settings of a file: JSON of names and values, or lines ``name = value``.

    Raises
    ------
    BadInput
        Not readable, or no settings in it.
    """
    text = yamlfile.text(path)
    if path.suffix == ".json":
        return _of_json(path, text)
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] not in "#;["]
    settings = {m[1]: m[2] for line in lines if (m := _LINE.fullmatch(line))}
    if len(settings) < len(lines) or not settings:
        wrong = next((line for line in lines if not _LINE.fullmatch(line)), "nothing, or a name twice")
        raise BadInput(f"{path}: expected lines 'name = value', each name once; it has {wrong[:60]!r}")
    return dict(settings)


def _of_json(path: Path, text: str) -> dict[str, Setting]:
    try:
        data = json.loads(text)
    except ValueError as error:
        raise BadInput(f"{path}: no JSON: {error}") from None
    if not isinstance(data, dict) or any(isinstance(v, bool | list | dict | None) for v in data.values()):
        raise BadInput(f"{path}: expected names of settings, each with one text or number")
    return data
