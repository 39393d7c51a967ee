"""Findings of a check of G-code, as plain data: the form of :class:`sensorgen.core.findings.Finding`, with lines."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partialmethod

from sensorgen.core.findings import SEVERITIES


@dataclass(frozen=True, slots=True)
class GcodeFinding:
    """One finding of one rule.

    Attributes
    ----------
    rule : str
        Name of the rule, as in ``speed``.
    severity : str
        "error", "warning" or "info".
    line : int
        First line of the file where it shows, from 1 [-].
    message : str
        What is the matter, in one sentence.
    advice : str
        What to change.
    count : int
        In how many lines it shows [-].
    """

    rule: str
    severity: str
    line: int
    message: str
    advice: str
    count: int = 1


class Findings(list[GcodeFinding]):
    """Findings of a check as it goes on."""

    def add(self, severity: str, rule: str, line: int, message: str, advice: str) -> None:
        """Add one; an error refuses the file."""
        self.append(GcodeFinding(rule, severity, line, message, advice))

    error, warning, info = partialmethod(add, "error"), partialmethod(add, "warning"), partialmethod(add, "info")


def merged(findings: Iterable[GcodeFinding]) -> tuple[GcodeFinding, ...]:
    """Findings of the same words as one, which has the first line; the severe first, and then by line.

    Bytes of the file that are no UTF-8 are written out, so that any text can hold them.
    """
    by_words: dict[tuple[str, str, str], GcodeFinding] = {}
    for given in findings:
        f = replace(given, message=given.message.encode("utf-8", "backslashreplace").decode())
        key = (f.rule, f.severity, f.message)
        old = by_words.get(key)
        by_words[key] = f if old is None else replace(old, count=old.count + f.count)
    return tuple(sorted(by_words.values(), key=lambda f: (SEVERITIES.index(f.severity), f.line, f.rule)))
