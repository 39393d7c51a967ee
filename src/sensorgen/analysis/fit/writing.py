"""A fit as a source: the YAML file that materials are read from."""

import json

from sensorgen.analysis.fit.results import Fit
from sensorgen.core.version import __version__


def text(made: Fit) -> str:
    """The file of the source.

    Parameters
    ----------
    made : Fit
        As :func:`sensorgen.analysis.fit.fit` makes it.
    """
    lines = [
        f"about: {_said(about(made))}",
        "materials:",
    ]
    for material in dict.fromkeys(value.material for value in made.values):
        lines.append(f"  {material}:")
        for value in made.values:
            if value.material == material:
                numbers = ", ".join(f"{name}: {getattr(value, name):.6g}" for name in ("value", "low", "high"))
                lines.append(f"    {value.quantity}: {{{numbers}, note: {_said(value.note)}}}")
    lines += [f"# not determined: {' '.join(f'{u.parameter}: {u.why}'.split())}" for u in made.untold]
    return "\n".join(lines) + "\n"


def about(made: Fit) -> str:
    """Description of the source, in a sentence."""
    return (
        f"fit of {made.of}: {made.specimens} specimens, {len(made.held_back)} held back (seed "
        f"{made.seed}); sensorgen {__version__}; data {made.log[:16]}"
    )


def _said(text: str) -> str:
    """Text as YAML has it in quotes, which is how JSON has it."""
    return json.dumps(text, ensure_ascii=True)
