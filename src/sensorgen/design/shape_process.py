"""Run a shape's file: as a program, in a process with limits that asks for and answers plain data.

Started as ``python -I -S shape_process.py``: the first line of its input is the file, each further one a question, and
each line of its output an answer, all JSON. What the file prints goes nowhere; it cannot open files, start programs or
reach a network. The limits keep mistakes from doing harm; they are no wall against somebody who knows Python well.
"""

import dataclasses
import json
import os
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

_DENIED = (
    "os.", "subprocess.", "socket.", "shutil.", "ctypes.", "pty.", "urllib.", "http.", "ftplib.", "smtplib.",
    "sqlite3.", "tempfile.", "webbrowser.", "signal.", "fcntl.", "mmap.", "syslog.", "glob.",
)  # fmt: skip
_ALLOWED = ("os.listdir", "os.scandir")  # as imports of the standard library do


class TooLong(BaseException):
    """The time for one question is over."""


def module_of(name: str, text: str) -> ModuleType:
    """Run the text of a shape's file as a module; raises whatever it raises."""
    module = ModuleType(name)
    module.__file__ = f"{name}.py"
    sys.modules[name] = module  # where dataclasses look
    exec(compile(text, f"{name}.py", "exec"), module.__dict__)  # noqa: S102 - trusted, or in a process of its own
    return module


def described(module: ModuleType) -> dict[str, Any]:
    """What a module says of its shape."""
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


def fault(error: BaseException, file: str) -> str:
    """An error as one line with the file's line that it comes from."""
    line: int | None = error.lineno if isinstance(error, SyntaxError) else None
    trace = error.__traceback__
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == file else line
        trace = trace.tb_next
    where = f"{file}, line {line}" if line else file
    if isinstance(error, MemoryError):
        return f"{where}: needs more memory than a shape may have"
    if isinstance(error, TooLong):
        return f"{where}: still running when its time was over"
    message = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{where}: {type(error).__name__}: {' '.join(message.split())[:300]}"


def _answer(module: ModuleType, question: Mapping[str, Any]) -> Any:
    params = module.Params(**question["parameters"])
    if "fill" not in question:
        return params.cells()
    from sensorgen.scene.scene import Fill

    made = module.scene(params, Fill(**question["fill"]))
    if not dataclasses.is_dataclass(made) or isinstance(made, type):
        raise TypeError(f"scene() gives {type(made).__name__}; expected a Scene")
    return dataclasses.asdict(made)


def _limit(memory_bytes: int) -> None:
    """Limit memory, forbid files to write and processes to start, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for which, most in (("RLIMIT_AS", memory_bytes), ("RLIMIT_FSIZE", 0), ("RLIMIT_NPROC", 0), ("RLIMIT_CORE", 0)):
        if hasattr(resource, which):
            try:
                resource.setrlimit(getattr(resource, which), (most, most))
            except (OSError, ValueError):
                continue


def _allow(seconds: int) -> None:
    """Give the next question its processor time."""
    try:
        import resource
    except ImportError:
        return
    _LATE[0] = 0
    used = resource.getrusage(resource.RUSAGE_SELF)
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    soft = int(used.ru_utime + used.ru_stime) + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (soft if hard < 0 else min(soft, hard), hard))


def _refuse(event: str, given: tuple[Any, ...]) -> None:
    """Audit hook: a shape computes and does nothing else."""
    if event == "open":
        path, mode = str(given[0]), given[1]
        inside = path.startswith((_LIBRARY, _PACKAGE)) or path.endswith(".pyc")
        if not inside or (isinstance(mode, str) and not set(mode) <= set("rb")):
            raise PermissionError(f"a shape opens no files ({path[:80]})")
    elif event.startswith(_DENIED) and event not in _ALLOWED:
        raise PermissionError(f"a shape does nothing but compute ({event})")


_LIBRARY = str(Path(os.__file__).parent)
_PACKAGE = str(Path(__file__).resolve().parents[1])


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

    __import__("sensorgen.scene.scene")
    sys.path.pop(0)  # the standard library is left
    end_with_parent()
    first = json.loads(source.readline())
    file = f"{first['name']}.py"
    if hasattr(signal, "SIGXCPU"):
        signal.signal(signal.SIGXCPU, _stop)
    _limit(first["memory_bytes"])
    sys.addaudithook(_refuse)

    def reply(work: Callable[[], Any]) -> Any:
        try:
            try:
                _allow(first["seconds"])
                line = json.dumps({"answer": (made := work())}, allow_nan=False)
            except SensorgenError as error:
                made, line = None, json.dumps({"refused": str(error), "kind": type(error).__name__})
            except (BaseException, RecursionError) as error:
                made, line = None, json.dumps({"fault": fault(error, file)})
            sink.write(f"{line}\n".encode())
            sink.flush()
        except TooLong as error:
            sink.write(f"{json.dumps({'fault': fault(error, file)})}\n".encode())
            sink.flush()
            made = None
        return made

    module: list[ModuleType] = []

    def begin() -> Any:
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
