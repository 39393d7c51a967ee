"""Plain moves of a piece of G-code, read all at once into columns; whatever else a line says is left to others.

Nine lines in ten of a print are as ``G1 X12.3 Y4.5 E.067``. They need no reading word by word: which byte may follow
which tells whether a line is one of them, and the numbers of all of them are then read in one go.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole

Bytes = NDArray[np.uint8]

WORDS = "XYZEFIJR"  # of a move or an arc, in the order of the columns
SPACE, DIGIT, SIGN, DOT, WORD, END, OTHER = range(7)  # sorts of bytes
_SORTS = 7
_BYTES = {SPACE: b" ", DIGIT: b"0123456789", SIGN: b"+-", DOT: b".", WORD: WORDS.encode(), END: b";\n"}
_BEHIND = {  # which sort may stand behind which in a plain move
    SPACE: (SPACE, WORD, END), WORD: (DIGIT, SIGN, DOT), SIGN: (DIGIT, DOT), DOT: (DIGIT,),
    DIGIT: (DIGIT, DOT, SPACE, END),
}  # fmt: skip
_SORT = bytes(next((sort for sort, those in _BYTES.items() if byte in those), OTHER) for byte in range(256))
_WRONG = bytes(pair % _SORTS not in _BEHIND.get(pair // _SORTS, ()) for pair in range(256))
_BLANK = bytes(32 if byte in _BYTES[WORD] else byte for byte in range(256))
_COLUMN = np.array([max(_BYTES[WORD].find(byte), 0) for byte in range(256)])


@dataclass(frozen=True, eq=False)
class Columns:
    """Content of a piece of G-code in columns.

    Attributes
    ----------
    start, end : (n,) int64 array
        Where each line starts, and where it ends, without its line feed [-].
    plain : (m,) int64 array
        Lines that are plain moves, from 0 [-].
    code : (m,) float64 array
        0 to 3, for G0 to G3 [-].
    words : (m, 8) float64 array
        Numbers of ``WORDS``; nan where a line has no such word.
    rest : (k,) int64 array
        All other lines that are not empty [-].
    """

    start: Whole
    end: Whole
    plain: Whole
    code: Real
    words: Real
    rest: Whole


def read(text: bytes) -> Columns:
    r"""Read the plain moves of some lines.

    Parameters
    ----------
    text : bytes
        Whole lines, the last one too with its line feed.

    Examples
    --------
    >>> found = read(b"G1 X1.5 E-.2 ; wall\nM83\n\nG0 Z2\n")
    >>> found.plain.tolist(), found.rest.tolist(), found.words[:, :4].tolist()
    ([0, 3], [1], [[1.5, nan, nan, -0.2], [nan, nan, 2.0, nan]])
    """
    data = np.frombuffer(text, np.uint8)
    sorts = np.frombuffer(text.translate(_SORT), np.uint8)
    end = np.flatnonzero(data == ord("\n"))
    start = np.concatenate([[0], end[:-1] + 1])
    stops = np.flatnonzero(sorts == END)
    stop = stops[np.searchsorted(stops, start)]  # of the code, before a comment
    # lines that start with G0 to G3 and a space, and are ASCII
    plain: Mask = stop - start >= len("G1 ")
    letter, digit, space = (np.where(plain, start + k, 0) for k in range(3))
    plain &= (data[letter] == ord("G")) & (sorts[digit] == DIGIT) & (data[digit] < ord("4")) & (sorts[space] == SPACE)
    plain[np.searchsorted(end, np.flatnonzero(data > 127))] = False
    # lines in whose words no byte stands behind one that it may not follow
    pairs = sorts[:-1] * np.uint8(_SORTS) + sorts[1:]
    wrong = np.frombuffer(pairs.tobytes().translate(_WRONG), np.uint8)
    before = np.concatenate([[0], np.cumsum(wrong, dtype=np.int32)])
    plain &= before[stop] == before[np.minimum(start + 2, stop)]
    line, words = _numbers(data, start, stop, np.flatnonzero(plain))
    rest = end > start
    rest[line] = False
    return Columns(start, end, line, data[start[line] + 1] - float(ord("0")), words, np.flatnonzero(rest))


def _numbers(data: Bytes, start: Whole, stop: Whole, line: Whole) -> tuple[Whole, Real]:
    """Those of some lines whose words are numbers, each letter once, and these numbers."""

    def words_of(line: Whole) -> tuple[Bytes, Whole, Whole]:
        """Bytes behind G0 to G3 of some lines; of each word the number of its line, and its place in the bytes."""
        edges = np.zeros(len(data) + 1, np.int8)
        edges[start[line] + 2] = 1
        edges[stop[line]] = -1
        put = data[np.cumsum(edges[:-1], dtype=np.int8).view(np.bool_)]
        word = np.flatnonzero(put >= ord("E"))
        return put, np.searchsorted(np.cumsum(stop[line] - start[line] - 2), word, side="right"), word

    put, row, word = words_of(line)
    of = np.searchsorted(word, np.flatnonzero(put == ord("."))) - 1
    twice = of[1:][of[1:] == of[:-1]]  # words whose number has two dots
    if len(twice):
        line = np.delete(line, row[twice])
        put, row, word = words_of(line)
    words = np.full((len(line), len(WORDS)), np.nan)
    words[row, _COLUMN[put[word]]] = np.fromstring(put.tobytes().translate(_BLANK), dtype=np.float64, sep=" ")
    once = np.bincount(row, minlength=len(line)) == len(WORDS) - np.isnan(words).sum(axis=1)
    return line[once], words[once]
