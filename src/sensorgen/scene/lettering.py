"""Letters of square dots, five rows high, of which a printed line draws every stroke."""

from collections.abc import Iterator

LINE_DOTS = 5  # height of a letter; one more between lines

# Each letter in rows from top to bottom. No dot hangs on corners alone: slicers leave such a dot out.
FONT = {
    "0": "### #.# #.# #.# ###", "1": ".#. ##. .#. .#. ###", "2": "### ..# ### #.. ###", "3": "### ..# .## ..# ###",
    "4": "#.# #.# ### ..# ..#", "5": "### #.. ### ..# ###", "6": "### #.. ### #.# ###", "7": "### ..# ..# ..# ..#",
    "8": "### #.# ### #.# ###", "9": "### #.# ### ..# ###", ".": ".. .. .. ## ##",
    "B": "###. #.#. #### #..# ####", "C": "### #.. #.. #.. ###", "D": "##. #.# #.# #.# ##.",
    "E": "### #.. ##. #.. ###", "F": "### #.. ##. #.. #..",
    "I": "### .#. .#. .#. ###", "L": "#.. #.. #.. #.. ###", "M": "##### #.#.# #.#.# #.#.# #.#.#",
    "N": "#..# ##.# #### #.## #..#", "O": "### #.# #.# #.# ###", "Q": "#### #..# #..# #.## ####",
    "R": "#### #..# #### #.#. #.##", "S": "### #.. ### ..# ###", "T": "### .#. .#. .#. .#.", "U": "#.# #.# #.# #.# ###",
    "A": "### #.# ### #.# #.#", "X": "#...# ##.## .###. ##.## #...#", "Y": "#.# #.# ### .#. .#.",
}  # fmt: skip


def runs(line: str, row: int) -> Iterator[tuple[int, int]]:
    """Where one row of dots of a line of letters starts and ends [dots]."""
    pattern = "".join(_glyph(letter)[row] + "." for letter in line)
    start = None
    for place, dot in enumerate(pattern):
        if dot == "#" and start is None:
            start = place
        elif dot == "." and start is not None:
            yield start, place
            start = None


def dots(line: str) -> int:
    """Length of a line of letters [dots]."""
    return sum(len(_glyph(letter)[0]) + 1 for letter in line) - 1


def _glyph(letter: str) -> list[str]:
    return [".."] * LINE_DOTS if letter == " " else FONT[letter].split()
