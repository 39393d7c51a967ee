"""The command line: words in, words out. Each command imports its work inside itself."""

import importlib
import os
import sys
from typing import Any

import click

from sensorgen import __version__
from sensorgen.errors import SensorgenError, Unprintable

COMMANDS = ("build", "check", "draw", "predict", "list", "schema", "completion")
WRONG_INPUT = 2
FOUND_ERRORS = 1


class _Lazy(click.Group):
    """Commands that are imported when they are asked for: ``cli/NAME_command.py`` holds ``command``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"sensorgen.cli.{name}_command").command
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            from sensorgen.errors import UnknownName

            raise UnknownName("command", args[0], COMMANDS)
        return super().resolve_command(ctx, args)


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="sensorgen")
def cli() -> None:
    """From one design to a printable elastomer sensor: geometry, checks, 3MF, profiles, prediction.

    \b
    sensorgen build tri --dielectric 0.2      a shape, with options for its parameters
    sensorgen build designs/23/trix-d0.2.yaml a design file
    """


def main() -> None:
    """Run the command line and leave with 0 (clean), 1 (findings of severity error) or 2 (wrong input)."""
    try:
        code = cli.main(prog_name="sensorgen", standalone_mode=False)
        sys.stdout.flush()
    except Unprintable as error:
        code = _complain(error, FOUND_ERRORS)
    except SensorgenError as error:
        code = _complain(error, WRONG_INPUT)
    except click.ClickException as error:
        code = _complain(error.format_message(), WRONG_INPUT)
    except MemoryError:
        code = _complain("not enough memory for this design: use a longer period or a smaller sensor", WRONG_INPUT)
    except (KeyboardInterrupt, click.Abort):
        code = _complain("interrupted; no file was changed", 130)
    except BrokenPipeError:  # the reader of a pipe has gone: nothing to say, and nobody to say it to
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code if isinstance(code, int) else 0)


def _complain(what: object, code: int) -> int:
    click.echo(f"sensorgen: {what}", err=True)
    return code
