"""Text of strangers, without the characters that a terminal obeys: colours, titles, changes of direction."""

import re

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def harmless(text: str) -> str:
    r"""Text without these characters.

    >>> harmless("a\x1b]0;title\x07b\tc\n")
    'a]0;titleb\tc\n'
    """
    return _CONTROL.sub("", text)


def escaped(text: str) -> str:
    r"""Escape a text for JSON, where nothing of it may be lost.

    >>> escaped('"a\u202eb"' + "\n")
    '"a\\u202eb"\n'
    """
    return _CONTROL.sub(lambda match: f"\\u{ord(match[0]):04x}", text)
