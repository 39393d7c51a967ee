"""Shapes: those that ship are modules; the file of one from a pack runs once the user trusts its content, confined.

Its process computes and does nothing else (:mod:`sensorgen.design.shape_process`), has limits of time and memory, and
what comes back is plain data, which is checked. Answers are stored by content (:mod:`sensorgen.core.cache`): a shape
runs once for each set of parameters.
"""

import dataclasses
import json
import math
import queue
import re
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from functools import cache, lru_cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Protocol, cast

from pydantic import ValidationError

from sensorgen.core import cache as answers
from sensorgen.core import files
from sensorgen.core.display import harmless
from sensorgen.core.errors import BadInput, NotTrusted, OutOfRange
from sensorgen.core.records import problem
from sensorgen.design import packs, shape_process
from sensorgen.scene.polyhedra import Loft, Polyhedron
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import FLOATING, Body, Envelope, Fill, Prism, Scene

if TYPE_CHECKING:
    from pydantic import TypeAdapter

SECONDS = 5  # of processor time for one question; a scene takes milliseconds
MEMORY_BYTES = 1 << 30
MOST_BYTES = 1 << 24  # of an answer: 50 000 cells are less than half of it
TRUSTED = "trusted-shapes.txt"  # in the folder of the user's packs: hash and name, a line each
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
_TERMINALS = ("", "top", "middle", "bottom", FLOATING)
_OUTSIDE_MM = 1e-6


class Shape(Protocol):
    """Shape by the answers of its file."""

    __doc__: str | None

    @property
    def Params(self) -> type[Envelope]:  # noqa: N802 - a class
        """Parameters, with range and help."""

    def scene(self, p: Any, fill: Fill, /) -> Scene:
        """Bodies for parameters and materials."""


def _refuse_untrusted(name: str, text: str) -> None:
    if not is_trusted(text):
        raise NotTrusted(
            f"{name}.py is not trusted and did not run: a shape is a program; read it, then: sensorgen pack trust "
            f"shapes/{name}.py (its file, or the design's that contains it), and again after each change; SHA-256 "
            f"{digest(text)}"
        )


def load(name: str, text: str) -> Shape:
    """A shape by its name and the text of its file.

    Raises
    ------
    NotTrusted
        The user has not trusted this content; none of it ran.
    BadInput
        The file is no shape; the message names its line.
    """
    _refuse_untrusted(name, text)
    return _foreign(name, text)


def digest(text: str) -> str:
    """SHA-256 of a shape's file."""
    return sha256(text.encode()).hexdigest()


def varies(name: str, text: str, fill: Mapping[str, str]) -> bool:
    """Test whether a file's scene differs between two questions with its default parameters, in one process or in two.

    Raises
    ------
    BadInput
        The file is no shape.
    """
    replies = []
    for _ in range(2):
        process = _ShapeProcess(name, text)
        try:
            defaults = {str(field["name"]): field["default"] for field in process.about["fields"]}
            question = {"parameters": defaults, "fill": fill}
            replies += [process.ask(question), process.ask(question)]
        except (KeyError, TypeError):
            return False  # no parameters: what reads the file says so
        finally:
            process.close()
    return any(each != replies[0] for each in replies)


def is_trusted(text: str) -> bool:
    """Test whether the user has trusted a file with this very content."""
    with suppress(OSError, UnicodeDecodeError):
        lines = (packs.place() / TRUSTED).read_text("utf-8").splitlines()
        return digest(text) in {line.partition(" ")[0] for line in lines}
    return False


def trust(name: str, text: str) -> Path:
    """Let a shape's file with this content run, confined; path of the list of such files."""
    path, trusted = packs.place() / TRUSTED, ""
    if is_trusted(text):
        return path
    with suppress(OSError, UnicodeDecodeError):
        trusted = path.read_text("utf-8")
    with files.writing(path, "cannot write"):
        path.parent.mkdir(parents=True, exist_ok=True)
        files.replace(path, f"{trusted}{digest(text)} {name}\n".encode())
    return path


class _Foreign:
    """A shape whose file runs elsewhere: its parameters here, each scene from there."""

    def __init__(self, name: str, text: str) -> None:
        self._name, self._text = name, text
        reply = self._ask({})
        try:
            self.__doc__ = harmless(str(reply["about"])[:4000])
            short = str(reply["short"])  # of the names of designs, which are those of files
            self.SHORT = short if _NAME.fullmatch(short) else name
            parameters = _fields(name, reply)
        except (AttributeError, KeyError, TypeError, ValueError):
            raise BadInput(
                f"{name}.py: Params is no dataclass of parameters; expected one as in 'sensorgen new shape'"
            ) from None
        cells = self._cells
        self.Params: type[Envelope] = dataclasses.make_dataclass(
            "Params", parameters, bases=(Envelope,), frozen=True, namespace={"cells": lambda p: cells(p)}
        )
        self.scene = lru_cache(maxsize=256)(self._scene)

    def _cells(self, p: Envelope) -> float:
        cells: float = self._ask({"parameters": dataclasses.asdict(p)})  # checked where it is used
        return cells

    def _scene(self, p: Envelope, fill: Fill) -> Scene:
        data = self._ask({"parameters": dataclasses.asdict(p), "fill": dataclasses.asdict(fill)})
        try:
            return _checked(self._name, _decoded(data), fill)
        except ValidationError as error:
            raise BadInput(f"{self._name}.py: scene() gives no scene: {problem(error, data)}") from None

    def _ask(self, question: Mapping[str, Any]) -> Any:
        """Answer of the file, or its stored answer."""
        key = {"shape": digest(self._text), "question": question}
        known = answers.known(key)
        if known is None:
            known = _process(self._name, self._text).ask(question)
            try:
                answers.keep(key, known)
            except ValueError:
                raise BadInput(f"{self._name}.py: a number that is not finite; expected finite ones") from None
        return known


@lru_cache(maxsize=32)
def _foreign(name: str, text: str) -> Shape:
    return cast(Shape, _Foreign(name, text))


@dataclasses.dataclass(frozen=True)
class _ReadBody(Body):
    """A body by its plain data: of the kinds of pieces that there are."""

    pieces: tuple[Prism | Revolved | Loft | Polyhedron, ...]


@dataclasses.dataclass(frozen=True)
class _ReadScene(Scene):
    """A scene by its plain data."""

    bodies: tuple[_ReadBody, ...]


@cache
def _adapter() -> "TypeAdapter[_ReadScene]":
    from pydantic import TypeAdapter

    return TypeAdapter(_ReadScene)


def _decoded(data: object) -> Scene:
    """A scene of plain data; raises ValidationError."""
    scene = _adapter().validate_python(data)
    bodies = (
        Body(**{field.name: getattr(body, field.name) for field in dataclasses.fields(Body)}) for body in scene.bodies
    )
    return Scene(tuple(bodies), scene.size_mm, scene.repeats)


def _fields(name: str, reply: Mapping[str, Any]) -> list[tuple[str, type, Any]]:
    """Parameters as a shape's file describes them, checked."""
    inherited = {f.name for f in dataclasses.fields(Envelope)}
    if missing := inherited - {str(field.get("name")) for field in reply["fields"]}:
        raise BadInput(f"{name}.py: Params has no {sorted(missing)[0]}; expected a dataclass derived from Envelope")
    return [_parameter(name, field) for field in reply["fields"]]


def _parameter(name: str, field: Mapping[str, Any]) -> tuple[str, type, Any]:
    """Name, type and field of a parameter; raises BadInput."""
    key, default, about = str(field["name"]), field["default"], dict(field["metadata"])
    about["help"] = harmless(about["help"]) if isinstance(about.get("help"), str) else ""
    where = f"{name}.py: parameter {key[:60]}"
    if not _NAME.fullmatch(key):
        raise BadInput(f"{where}: expected a name of small letters, digits and '_'")
    if not about["help"]:
        raise BadInput(f"{where} has no help; write metadata={{'help': ..., 'range': (low, high)}}")
    if choices := about.get("choices"):
        if default not in choices or not all(isinstance(each, str) and each.isprintable() for each in choices):
            raise BadInput(f"{where}: default {default!r:.40} is not among its choices, or one cannot be printed")
        about["choices"] = tuple(choices)
        return key, str, dataclasses.field(default=default, metadata=about)
    default, about["range"] = _in_range(where, default, about)
    return key, float, dataclasses.field(default=default, metadata=about)


def _in_range(where: str, default: Any, about: Mapping[str, Any]) -> tuple[float, tuple[float, float]]:
    """Default and range of a parameter; raises BadInput."""
    try:
        low, high = (float(end) for end in about["range"])
        sound = math.isfinite(high - low) and low <= float(default) <= high
    except (KeyError, TypeError, ValueError, OverflowError):
        raise BadInput(f"{where} has no range; write metadata={{'help': ..., 'range': (low, high)}}") from None
    if not sound:
        raise BadInput(f"{where}: default {default!r:.40} is outside its range {low:g} to {high:g}")
    return float(default), (low, high)


def _checked(name: str, scene: Scene, fill: Fill) -> Scene:
    """Refuse a scene that no sensor has.

    Raises
    ------
    BadInput
        No scene; a body without a sound name, terminal or material, or one that leaves the box.
    """
    if not all(math.isfinite(size) and size > 0 for size in scene.size_mm) or len(scene.size_mm) != 3:
        raise BadInput(f"{name}.py: size_mm is {scene.size_mm}; expected three lengths above 0")
    if not scene.bodies:
        raise BadInput(f"{name}.py: the scene has no bodies")
    names = [body.name for body in scene.bodies]
    for body in scene.bodies:
        _check_body(f"{name}.py: body {body.name[:60]!r}", body, scene.size_mm, names, fill)
    return scene


def _check_body(where: str, body: Body, size_mm: tuple[float, float, float], names: list[str], fill: Fill) -> None:
    """Raise BadInput for a body that no sensor has."""
    if not _NAME.fullmatch(body.name) or names.count(body.name) > 1:
        raise BadInput(f"{where}: expected a name of its own, of small letters, digits and '_'")
    if body.terminal not in _TERMINALS:
        raise BadInput(f"{where}: terminal {body.terminal[:40]!r}; expected top, middle, bottom, floating or ''")
    if not body.material or body.material not in dataclasses.asdict(fill).values():
        raise BadInput(f"{where}: material {body.material[:40]!r} is none of the design's; take it from fill")
    for piece in body.pieces:
        for axis, size in zip("xyz", size_mm, strict=True):
            low, high = piece.span(axis)
            if not -_OUTSIDE_MM <= low < high <= size + _OUTSIDE_MM:
                raise BadInput(f"{where}: {low:g} to {high:g} mm along {axis}; expected within 0 to {size:g} mm")


class _ShapeProcess:
    """The process that runs one shape's file."""

    def __init__(self, name: str, text: str) -> None:
        _refuse_untrusted(name, text)
        self.name = name
        self._process = subprocess.Popen(  # noqa: S603 - this very program
            [sys.executable, "-I", "-S", "-B", shape_process.__file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env={},
        )  # fmt: skip
        self._lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._wanted = threading.Semaphore(0)  # lines, one for each question: an endless answer would fill the memory
        threading.Thread(target=_read, args=(self._process.stdout, self._wanted, self._lines), daemon=True).start()
        with ExitStack() as ended:
            ended.callback(self.close)
            self.about = self._exchange({
                "name": name, "text": text, "seconds": SECONDS, "memory_bytes": MEMORY_BYTES, "libraries": _libraries(),
            })  # fmt: skip
            ended.pop_all()

    def ask(self, question: Mapping[str, Any]) -> Any:
        """The answer to a question; to an empty one, what the file says of itself."""
        return self._exchange(question) if question else self.about

    def _exchange(self, question: Mapping[str, Any]) -> Any:
        pipe = cast(IO[bytes], self._process.stdin)
        with suppress(OSError):
            pipe.write(f"{json.dumps(question)}\n".encode())
            pipe.flush()
        wait_s = 5 + 3 * SECONDS  # as other programs may run
        self._wanted.release()
        try:
            line = self._lines.get(timeout=wait_s)
        except queue.Empty:
            self.close()
            raise BadInput(
                f"{self.name}.py: no answer within {wait_s} s; a shape takes milliseconds: look for a loop without end"
            ) from None
        try:
            reply = json.loads(line, parse_constant=_refuse) if line else None
        except (ValueError, RecursionError):
            reply = None
        if not isinstance(reply, dict) or not reply.keys() & {"answer", "refused", "fault"}:
            code = self.close()
            why = "time or memory is over" if code < 0 else f"exit code {code}"
            raise BadInput(f"{self.name}.py: its process ended without an answer ({why}); a shape only computes")
        if "answer" in reply:
            return reply["answer"]
        if "refused" in reply:
            kind = OutOfRange if reply.get("kind") == "OutOfRange" else BadInput
            raise kind(str(reply["refused"])[:500])
        self.close()
        raise BadInput(str(reply["fault"])[:500])

    def close(self) -> int:
        """End the process; its exit code."""
        _RUNNING.pop(next((key for key, each in _RUNNING.items() if each is self), ("", "")), None)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(0.2)
        self._process.kill()
        self._wanted.release()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                pipe and pipe.close()
        return self._process.wait()


_RUNNING: dict[tuple[str, str], _ShapeProcess] = {}
_MOST = 4  # processes at once


def _process(name: str, text: str) -> _ShapeProcess:
    key = name, text
    if key not in _RUNNING:
        if len(_RUNNING) >= _MOST:
            next(iter(_RUNNING.values())).close()
        if not _RUNNING:
            import atexit

            atexit.register(close)
        process = _ShapeProcess(name, text)
        _RUNNING[key] = process
    return _RUNNING[key]


def close() -> None:
    """End the processes of all shape files; one that is needed again starts again."""
    for each in list(_RUNNING.values()):
        each.close()


def _read(pipe: IO[bytes], wanted: threading.Semaphore, lines: "queue.SimpleQueue[bytes]") -> None:
    with suppress(OSError, ValueError):
        while wanted.acquire():
            line = pipe.readline(MOST_BYTES)
            lines.put(line if line.endswith(b"\n") else b"")
            if not line:
                return


def _libraries() -> list[str]:
    """Folders of the libraries that a shape may import: its process starts without any."""
    specs = [find_spec(name) for name in shape_process.LIBRARIES]
    return sorted({str(Path(spec.origin).parents[1]) for spec in specs if spec and spec.origin})


def _refuse(word: str) -> Any:
    raise ValueError(word)
