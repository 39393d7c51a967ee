"""Names to things: what stands in a folder is known by its file name, and loaded when it is used."""

import importlib
from functools import cache
from pathlib import Path
from types import ModuleType

from sensorgen.core.errors import UnknownName


@cache
def names(package: ModuleType) -> list[str]:
    """Names of the modules in a package, without loading any."""
    return sorted(p.stem for p in Path(next(iter(package.__path__))).glob("[!_]*.py"))


@cache
def stating(package: ModuleType, start: str) -> tuple[str, ...]:
    """Names of the modules that have a line which starts with a text, as ``def f(``, without loading any."""
    folder = Path(next(iter(package.__path__)))
    texts = ((name, (folder / f"{name}.py").read_text("utf-8")) for name in names(package))
    return tuple(name for name, text in texts if f"\n{start}" in text)


def load(package: ModuleType, name: str) -> ModuleType:
    """Load one module of a package by its name.

    Raises
    ------
    UnknownName
        Nothing goes by that name; the nearest one is offered.
    """
    if name not in names(package):
        raise UnknownName(package.__name__.rpartition(".")[2].removesuffix("s"), name, names(package))
    return importlib.import_module(f"{package.__name__}.{name}")
