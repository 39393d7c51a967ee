"""Options and arguments of the command line, stated in the annotation of the parameter or field that takes the value.

``sensorgen.cli.commands.options_of`` reads them, of a function as of a dataclass, so that the command line, the
signature in Python and its default come from one place.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Option:
    """Option of a command: what neither the parameter's name, type and default nor its docstring state.

    Attributes
    ----------
    about : str
        Help, of an option of several commands; of others the docstring has it.
    flags : tuple of str
        As ``("--output", "-o")``; made of the parameter's name if not given.
    kind : Quantity, tuple of str, str, or click type; or None
        A quantity with its unit, one of some names, a kind of ``sensorgen.cli.commands.KINDS`` as "share", or any type
        of click; that of the annotation if None.
    typed : str or None
        Default as it would be typed and as the help shows it, in place of the parameter's.
    metavar : str or None
        Placeholder of the value in the help; that of its type if None.
    zero : bool
        Of a quantity: 0 is a value.
    more : mapping
        Further arguments of ``click.Option``.
    """

    about: str = ""
    flags: tuple[str, ...] = ()
    kind: Any = None
    typed: str | None = None
    metavar: str | None = None
    zero: bool = False
    more: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Argument:
    """Word of a command at its place; ``kind`` as of :class:`Option`."""

    kind: Any = None


@dataclass(frozen=True)
class Without:
    """Names of the fields of a record that a command has no option for."""

    names: tuple[str, ...]
