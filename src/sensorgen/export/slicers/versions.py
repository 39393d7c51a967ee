"""Versions of the slicers: what each has renamed, dropped or added since the one that the templates are written for.

One file per version, ``slicer_profiles/versions/<slicer>-<version>.yaml``. Those up to the slicer's own version are
applied to the templates in order, so that each has only what differs from the one before.
"""

import re
import subprocess
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding
from sensorgen.core.records import Strict, checked
from sensorgen.design import packs

Version = tuple[int, ...]  # (2, 9, 2); () is the oldest that the templates are written for

_ASKED = {"prusa": ("--help", r"PrusaSlicer-([0-9.]+)"), "cura": ("help", r"Cura_SteamEngine version ([0-9.]+)")}
_ANSWER_S = 30.0  # within which a program says its version
_SETTING = re.compile(r"^([a-z0-9_]+) = (.*)$")


class VersionChange(Strict):
    """Difference of a version from the one before.

    Attributes
    ----------
    title, source : str
        Its name, and where this was found.
    dropped : tuple of str
        Settings that it no longer has.
    renamed : mapping of str to str
        Old name of a setting to its new one.
    values : mapping of str to mapping of str to str
        Old name of a setting to its old values and what they are called now.
    added : mapping of str to str
        Template to further lines at its end, for settings that are new.
    """

    title: str
    source: str
    dropped: tuple[str, ...] = Field(default=(), strict=False)  # YAML has lists only
    renamed: dict[str, str] = Field(default={})
    values: dict[str, dict[str, str]] = Field(default={})
    added: dict[str, str] = Field(default={})

    def adapted(self, name: str, text: str) -> str:
        """The text of the template ``name``, its settings those of this version."""
        lines = []
        for line in text.splitlines():
            if setting := _SETTING.match(line):
                key, value = setting.groups()
                if key in self.dropped:
                    continue
                line = f"{self.renamed.get(key, key)} = {self.values.get(key, {}).get(value, value)}"
            lines.append(line)
        return "\n".join(lines) + "\n" + self.added.get(name, "")


@cache
def changes(slicer: str) -> dict[Version, VersionChange]:
    """Changes of a slicer's versions, the oldest first.

    Raises
    ------
    BadInput
        A file is not as :class:`VersionChange` has it.
    """
    by_version = {}
    for path in (packs.profiles() / "versions").glob(f"{slicer}-*.yaml"):
        try:
            by_version[parse(path.stem.partition("-")[2])] = checked(VersionChange, yamlfile.read(path))
        except BadInput as error:
            raise error.within(str(path)) from None
    return dict(sorted(by_version.items()))


def folders(slicer: str) -> dict[str, Version]:
    """Folder of a slicer's profiles to the version that they are for: the oldest, and the newest beside it."""
    *_, newest = changes(slicer)
    return {slicer: (), f"{slicer}-{newest[0]}.{newest[1]}": newest}


def template(slicer: str, version: Version, name: str) -> str:
    """Text of a template of a slicer, adapted to its version."""
    text = (packs.profiles() / slicer / name).read_text("utf-8")
    for since, change in changes(slicer).items():
        if since <= version:
            text = change.adapted(name, text)
    return text


def parse(text: str) -> Version:
    """Version from its text.

    >>> parse("2.9.2")
    (2, 9, 2)
    """
    return tuple(int(part) for part in text.split(".") if part)


def of_program(slicer: str, program: str) -> Version:
    """Version that a slicer's program gives itself; () where it does not say."""
    path = Path(program)
    return _said(slicer, program, path.stat().st_mtime_ns if path.exists() else 0)


@cache
def _said(slicer: str, program: str, _changed_ns: int) -> Version:
    word, pattern = _ASKED[slicer]
    with tempfile.TemporaryFile() as output:  # a pipe would be waited for as long as a child of its holds it open
        try:
            subprocess.run(  # noqa: S603
                [program, word], stdout=output, stderr=output, stdin=subprocess.DEVNULL, timeout=_ANSWER_S, check=False
            )
        except (OSError, subprocess.TimeoutExpired):
            return ()
        output.seek(0)
        match = re.search(pattern, output.read().decode("utf-8", "replace"))
    return parse(match[1]) if match else ()


def unknown(title: str, keys: Iterable[str]) -> tuple[Finding, ...]:
    """A finding for settings of a profile that the slicer does not know: it ignores them in silence."""
    if not (names := sorted(keys)):
        return ()
    return (
        Finding(
            "11-profile", "warning", "sensor", f"{title} does not know {', '.join(names)}: ignored",
            "correct the name, or slice with a version that knows the setting", count=len(names),
        ),
    )  # fmt: skip
