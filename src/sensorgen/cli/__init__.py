"""The command line: words in, words out. Each command imports its work inside itself."""

import gc
import importlib
import json
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

import click

from sensorgen.core.display import harmless
from sensorgen.core.errors import SensorgenError, Unprintable, nearest
from sensorgen.core.version import __version__

# Of each command its module and what it is for, by sections, so that --help imports none of them
SECTIONS: dict[str, dict[str, tuple[str, str]]] = json.loads(
    Path(__file__).with_name("commands.json").read_text("utf-8")
)
COMMANDS = tuple(name for commands in SECTIONS.values() for name in commands)
WRONG_INPUT = 2
FOUND_ERRORS = 1


_ELSEWHERE = {  # options of other programs, and where the quantity is here
    "--layer-height": ": the print quality has it; take another with --quality (sensorgen list qualities), or your own "
    "(sensorgen new quality NAME).",
}


class _Lazy(click.Group):
    """Commands, imported when used: ``command`` of a module, or ``NAME_command`` where it has several."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(COMMANDS)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """The commands in sections."""
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name, about) for name, (_, about) in commands.items()])

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:  # noqa: ARG002
        if name not in COMMANDS:
            return None
        place, about = next(commands[name] for commands in SECTIONS.values() if name in commands)
        module = importlib.import_module(f"sensorgen.{place}")
        command: click.Command = getattr(module, f"{name}_command", None) or module.command
        command.short_help = about
        return command

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except BrokenPipeError:  # the reader of a pipe has gone: nothing to say, and nobody to say it to
            return _silence()

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if not ctx.resilient_parsing and not args[0].startswith("-") and args[0] not in COMMANDS:
            from sensorgen.core.errors import UnknownName

            raise UnknownName("command", args[0], COMMANDS)
        return super().resolve_command(ctx, args)


class _Terminated(BaseException):
    """Somebody asked this process to end (SIGTERM)."""


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="sensorgen")
@click.option("--trust-printer", is_flag=True, help="Let printer files widen limits of hardware and G-code.")
@click.option("--trust-cluster", is_flag=True, help="Let --cluster use a network without TLS; workers run code.")
def cli(*, trust_printer: bool, trust_cluster: bool) -> None:
    """From one design to a printable elastomer sensor: geometry, checks, 3MF, profiles, prediction.

    \b
    sensorgen build tri --dielectric 0.2        a shape, with options
    sensorgen build designs/23/trix-d0.2.yaml   a design file
    """  # noqa: D301 - click reads the backspace
    if trust_printer:
        from sensorgen.design.printer import TRUST

        os.environ[TRUST] = "1"
    if trust_cluster:
        from sensorgen.core.parallel import TRUST_CLUSTER

        os.environ[TRUST_CLUSTER] = "1"


def main() -> None:
    """Run the command line and leave with 0 (clean), 1 (findings of severity error) or 2 (wrong input)."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads: on small matrices threads only wait
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # to look for them takes 17 ms
    warnings.showwarning = _unseen
    gc.set_threshold(10_000)  # rows of a log are no garbage: to look through them after every 700 takes a tenth
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever started this
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
    try:
        code = _run()
        sys.stdout.flush()
    except MemoryError:
        code = _complain("not enough memory for this design: use a longer period or a smaller sensor", WRONG_INPUT)
    except (KeyboardInterrupt, click.Abort):
        code = _complain("interrupted; no file is half-written", 128 + signal.SIGINT)
    except _Terminated:
        code = _complain("stopped; no file is half-written", 128 + signal.SIGTERM)
    except (OSError, UnicodeEncodeError) as error:
        _silence()
        code = _complain(f"cannot write the output: {getattr(error, 'strerror', None) or error}", WRONG_INPUT)
    try:  # what a stopped command has left
        sys.stdout.flush()
    except OSError:
        _silence()
    sys.exit(code)


def _unseen(*_: object, **__: object) -> None:
    """Show no warning of a library, as NumPy's of a division by zero: what matters to a user is in the result."""


def _run() -> int:
    try:
        with _stoppable():
            code = cli.main(prog_name="sensorgen", standalone_mode=False)
    except Unprintable as error:
        return _complain(error, FOUND_ERRORS)
    except SensorgenError as error:
        return _complain(error, WRONG_INPUT)
    except click.NoSuchOption as error:
        meant = nearest(error.option_name, error.possibilities or ())
        near = f"; did you mean '{meant}'?" if meant else _ELSEWHERE.get(error.option_name, ".")
        return _complain(f"unknown option '{error.option_name}'{near} --help lists all", WRONG_INPUT)
    except click.ClickException as error:
        return _complain(error.format_message(), WRONG_INPUT)
    return code if isinstance(code, int) else 0


@contextmanager
def _stoppable() -> Iterator[None]:
    """Raise on Ctrl-C and SIGTERM, also where a library makes an error of its own of what was raised within it."""
    asked: list[type[BaseException]] = []

    def stop(number: int, _: FrameType | None) -> NoReturn:
        asked.append(_Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise asked[-1]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number, handler in before.items():
            if handler is not signal.SIG_IGN:  # as below nohup, or in the background of a shell
                signal.signal(number, stop)
        yield
    except Exception:
        if asked:
            raise asked[0] from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def unread() -> Iterator[None]:
    """Go on in silence where the reader of a pipe has gone: what is left to do are files."""
    try:
        yield
    except BrokenPipeError:
        _silence()


def _silence() -> int:
    """Let what is still in the output's buffer go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _complain(what: object, code: int) -> int:
    text = harmless(str(what))
    with suppress(OSError):  # nobody reads it
        click.echo(text if text.startswith("Usage:") else f"sensorgen: {' '.join(text.split())}", err=True)
    return code
