"""Run a shape's file: as a program, in a confined process that asks for and answers plain data.

Started as ``python -I -S shape_process.py`` with no environment: the first line of its input is the file, each further
one a question, and each line of its output an answer, all JSON. What the file may import is imported before the process
is confined (:mod:`sensorgen.core.confine`), and only then the file runs: it computes, and reads and writes these pipes.
"""

import dataclasses
import json
import os
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

resource: Any = None
with suppress(ImportError):  # Windows
    import resource

LIBRARIES = ("numpy", "shapely")  # of others, that a shape may import
_MODULES = (
    *LIBRARIES, "array", "bisect", "cmath", "collections", "copy", "dataclasses", "decimal", "enum", "fractions",
    "functools", "hashlib", "heapq", "itertools", "json", "math", "numbers", "numpy.fft", "numpy.polynomial",
    "numpy.random", "operator", "random", "re", "statistics", "string", "struct", "textwrap", "time", "typing",
    "sensorgen.scene.layers", "sensorgen.scene.patterns", "sensorgen.scene.polyhedra", "sensorgen.scene.revolved",
    "sensorgen.scene.sections",
)  # fmt: skip
_EARLIER = {  # names of a module in files that were written before
    f"sensorgen.scene.{name}": "sensorgen.scene.patterns" for name in ("array", "strips", "triangles")
}


class TooLong(BaseException):
    """The time for one question is over."""


def module_of(name: str, text: str) -> ModuleType:
    """Run the text of a shape's file as a module; raises whatever it raises."""
    module = ModuleType(name)
    module.__file__ = f"{name}.py"
    sys.modules[name] = module  # where dataclasses look
    exec(compile(text, f"{name}.py", "exec"), module.__dict__)  # noqa: S102 - in a confined process
    return module


def described(module: ModuleType) -> dict[str, Any]:
    """Description of a shape by its module."""
    params = module.Params
    return {
        "about": module.__doc__ or "",
        "short": getattr(module, "SHORT", ""),
        "scene": callable(module.scene),
        "fields": [
            {"name": f.name, "default": f.default, "metadata": {k: f.metadata[k] for k in f.metadata}}
            for f in dataclasses.fields(params)
        ],
    }


def _line(error: BaseException, file: str) -> int | None:
    """The last line of a file that an error comes through."""
    line: int | None = error.lineno if isinstance(error, SyntaxError) else None
    trace = error.__traceback__
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == file else line
        trace = trace.tb_next
    return line


def fault(error: BaseException, file: str) -> str:
    """An error as one line with the file's line that it comes from."""
    from sensorgen.core.confine import Unconfined  # known by then: a process that is confined finds no module

    line = _line(error, file)
    where = f"{file}, line {line}" if line else file
    if isinstance(error, Unconfined):
        return f"{file}: {error}"
    if isinstance(error, MemoryError):
        return f"{where}: needs more memory than a shape may have"
    if isinstance(error, TooLong):
        return f"{where}: still running when its time was over"
    if isinstance(error, PermissionError):
        return f"{where}: a shape computes and does nothing else ({' '.join(str(error).split())[:300]})"
    message = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{where}: {type(error).__name__}: {' '.join(message.split())[:300]}"


def _answer(module: ModuleType, question: Mapping[str, Any]) -> Any:
    params = module.Params(**question["parameters"])
    if "fill" not in question:
        return params.cells()
    from sensorgen.scene.scene import Fill

    scene = module.scene(params, Fill(**question["fill"]))
    if not dataclasses.is_dataclass(scene) or isinstance(scene, type):
        raise TypeError(f"scene() gives {type(scene).__name__}; expected a Scene")
    return dataclasses.asdict(scene)


def _limit(memory_bytes: int) -> None:
    """Limit memory; forbid files, network and other processes, as far as the system can."""
    from sensorgen.core import confine

    limits = {"AS": memory_bytes, "FSIZE": 0, "NPROC": 0, "CORE": 0} | ({} if confine.available() else {"NOFILE": 0})
    for name, most in limits.items():
        with suppress(OSError, ValueError, AttributeError):
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (most, most))
    if confine.available():
        confine.confine()


def _import(text: str, libraries: list[str]) -> None:
    """Import the modules that a file names, of those that a shape may import; after this, no other is found."""
    import_module("sensorgen.core.confine")
    sys.path += libraries
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # a thread that exists already would not be confined
    for name, module in (dict(zip(_MODULES, _MODULES, strict=True)) | _EARLIER).items():
        if all(re.search(rf"\b{part}\b", text) for part in name.split(".")):  # also as np.random
            with suppress(ImportError):  # the file's own import says so
                sys.modules[name] = import_module(module)
    os.environ.clear()
    sys.path.clear()


def _allow(seconds: int) -> None:
    """Give the next question its processor time."""
    if resource is None:
        return
    _LATE[0] = 0
    used = resource.getrusage(resource.RUSAGE_SELF)
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    soft = int(used.ru_utime + used.ru_stime) + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (soft if hard < 0 else min(soft, hard), hard))


_LATE = [0]  # seconds since the time of a question was over


def _stop(_: int, __: FrameType | None) -> None:
    """Obey the system's signal: stop the file's code, or, where that goes on nevertheless, this process."""
    _LATE[0] += 1
    if _LATE[0] > 1:
        os._exit(1)
    raise TooLong


def main() -> None:
    """Read a file and questions, and answer them."""
    import signal

    source, sink = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    for handle in (0, 1, 2):
        os.dup2(nowhere, handle)
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from sensorgen.core.errors import SensorgenError
    from sensorgen.core.leash import end_with_parent

    end_with_parent()
    first = json.loads(source.readline())
    _import(f"sensorgen.scene.polyhedra sensorgen.scene.revolved {first['text']}", first["libraries"])
    file = f"{first['name']}.py"
    if hasattr(signal, "SIGXCPU"):
        signal.signal(signal.SIGXCPU, _stop)

    def reply(work: Callable[[], Any]) -> Any:
        try:
            try:
                _allow(first["seconds"])
                line = json.dumps({"answer": (answer := work())}, allow_nan=False)
            except SensorgenError as error:
                answer, line = None, json.dumps({"refused": str(error), "kind": type(error).__name__})
            except (BaseException, RecursionError) as error:
                answer, line = None, json.dumps({"fault": fault(error, file)})
            sink.write(f"{line}\n".encode())
            sink.flush()
        except TooLong as error:
            sink.write(f"{json.dumps({'fault': fault(error, file)})}\n".encode())
            sink.flush()
            answer = None
        return answer

    module: list[ModuleType] = []

    def begin() -> Any:
        _limit(first["memory_bytes"])
        module.append(module_of(first["name"], first["text"]))
        return described(module[0])

    if reply(begin) is None:
        return
    for line in source:
        question = json.loads(line)
        reply(partial(_answer, module[0], question))


if __name__ == "__main__":
    main()
    os._exit(0)
