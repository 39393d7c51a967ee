"""``sensorgen completion``: words that the shell completes."""

import click
from click.shell_completion import get_completion_class

from sensorgen.cli.words import OneOf


@click.command("completion")
@click.argument("shell", type=OneOf(["bash", "zsh", "fish"]))
def command(shell: str) -> None:
    """Print the completion script for a shell.

    \b
    bash:  eval "$(sensorgen completion bash)"
    zsh:   eval "$(sensorgen completion zsh)"
    fish:  sensorgen completion fish | source
    """  # noqa: D301 - click reads the backspace
    from sensorgen.cli import cli

    kind = get_completion_class(shell)
    if kind:  # click knows the three
        click.echo(kind(cli, {}, "sensorgen", "_SENSORGEN_COMPLETE").source())
