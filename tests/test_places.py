"""Where the files of a user are, on every system."""

from pathlib import Path

import pytest

from sensorgen.core import cache as cached
from sensorgen.core import files as places
from sensorgen.design.materials import source_folder
from sensorgen.measure.log import logbook

OWN = ("SENSORGEN_CACHE", "SENSORGEN_LOG", "SENSORGEN_MATERIALS")
VARIABLES = ("XDG_CACHE_HOME", "XDG_DATA_HOME", "LOCALAPPDATA", *OWN)
CACHE, LOG, MATERIALS = cached.folder, logbook.place, source_folder


@pytest.mark.parametrize(
    ("platform", "environment", "of", "expected"),
    [
        ("linux", {"XDG_CACHE_HOME": "/fast"}, CACHE, "/fast/sensorgen"),
        ("linux", {"XDG_CACHE_HOME": "relative"}, CACHE, "~/.cache/sensorgen"),
        ("darwin", {"XDG_CACHE_HOME": "/fast"}, CACHE, "~/Library/Caches/sensorgen"),
        ("win32", {"LOCALAPPDATA": "/local"}, CACHE, "/local/sensorgen"),
        ("win32", {}, CACHE, "~/AppData/Local/sensorgen"),
        ("linux", {"XDG_CACHE_HOME": "/fast", "SENSORGEN_CACHE": "/own"}, CACHE, "/own"),
        ("linux", {"XDG_DATA_HOME": "/data"}, LOG, "/data/sensorgen/log.db"),
        ("darwin", {}, LOG, "~/Library/Application Support/sensorgen/log.db"),
        ("linux", {"SENSORGEN_LOG": "own.db", "SENSORGEN_MATERIALS": "/m"}, LOG, "own.db"),
        ("linux", {"XDG_DATA_HOME": "relative"}, MATERIALS, "~/.local/share/sensorgen/materials"),
        ("linux", {"SENSORGEN_LOG": "own.db", "SENSORGEN_MATERIALS": "/m"}, MATERIALS, "/m"),
    ],
)
def test_where_they_are(monkeypatch, platform, environment, of, expected):
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(places.sys, "platform", platform)
    assert of() == Path(expected).expanduser()
