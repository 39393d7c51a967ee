"""Names of specimens, read as they were written down and written as they should be.

::

    23   triY   .2mm   3           x fine     m
    |    |      |      |           |          place on the plate: r, l or m
    |    |      |      |           slicing: fine (0.1 mm layers), x fine, xfine or xtrafine (0.06 mm)
    |    |      |      replicate, from 2 on where the first has no number
    |    |      film d; there is none where none is named
    |    shape with its axes: triX, triY, sqXY, sqYX, SX60 (the plain plate), double
    iteration of the design

The grammar is that of Table D.1 of the thesis, and its slips are read too: each is listed in ``assumed``.
"""

import re
import unicodedata
from dataclasses import dataclass, field
from functools import lru_cache

from sensorgen.core.errors import BadInput
from sensorgen.core.records import shown
from sensorgen.design.design import Design, make

MAX_LETTERS = 100
NO_FILM = "no film named: none"
THICKEST_MM = 10.0  # film that a design may have
_PLATE_MM = 0.6  # thickness of the plain plate, which its name does not tell
GRAMMAR = "<iteration> <triX|triY|sqXY|sqYX|SX60> [.1mm|.2mm] [replicate] [fine|x fine] [r|l|m], as in '23 triY .2mm 3'"
QUALITIES = {"": "", "fine": "fine", "x fine": "extrafine", "xfine": "extrafine", "xtrafine": "extrafine"}
_WORDS = {"tri": "tri", "rect": "sq", "reference": "SX60", "double": "double"}
_SHAPES = {"tri": "tri", "sq": "rect", "sa": "rect", "rect": "rect", "sx60": "reference", "reference": "reference",
           "double": "double"}  # fmt: skip
_AXES = {"tri": ("X", "Y"), "rect": ("XY", "YX"), "reference": ("",), "double": ("",)}
_LETTERS = str.maketrans({"¥": "Y", "V": "Y", "A": "X"})  # axes as a scan of the table reads them
_HEAD = re.compile(
    r"(?P<iteration>[0-9]{1,4}(?![0-9]))?\s*(?P<shape>sx60|reference|double|rect|tri|sq|sa)(?P<axes>[xyva¥]{0,2}(?![a-z]))"
)
_REST = {
    "film": re.compile(
        r"d?(?P<number>[0-9]{0,3}\.[0-9]{1,6}|[0-9]{1,3})\s*mm|d(?P<bare>[0-9]{0,3}\.?[0-9]{1,6})(?![0-9a-z])"
    ),
    "slicing": re.compile(r"(?P<word>x ?|e?xtra ?)?fine(?![a-z])"),
    "replicate": re.compile(r"(?P<number>[1-9][0-9]{0,3})(?![0-9.]|\s*mm)"),
    "place": re.compile(r"(?P<letter>[rlm])(?![a-z])"),
}  # fmt: skip


@dataclass(frozen=True)
class SpecimenName:
    """One printed sensor, by its name.

    Attributes
    ----------
    iteration : int or None
        Of the design; None where the name has none.
    shape : str
        Shape as designs call it: ``tri``, ``rect``, ``reference``, ``double``.
    axes : str
        ``X``, ``Y``, ``XY``, ``YX``, or "" where the name lacks it, or the shape has none.
    film_mm : float or None
        Thickness of the film [mm], 0 where the name has none; None where it has a size that is no film.
    replicate : int or None
        Which copy.
    slicing : str
        ``fine``, ``x fine``, ``xfine``, ``xtrafine`` or "", as written: two prints of the thesis differ in that alone.
    place : str
        ``r``, ``l``, ``m`` or "": where on the plate, as it seems (the thesis does not say).
    size_mm : float or None
        A size in the name that is no film [mm].
    raw : str
        The name as it was given.
    assumed : tuple of str
        What was read otherwise than written, and what remains uncertain.
    """

    iteration: int | None
    shape: str
    axes: str = ""
    film_mm: float | None = 0.0
    replicate: int | None = None
    slicing: str = ""
    place: str = ""
    size_mm: float | None = None
    raw: str = field(default="", compare=False)
    assumed: tuple[str, ...] = field(default=(), compare=False)

    @property
    def name(self) -> str:
        """The name in its normal form."""
        return self.format()

    @property
    def quality(self) -> str:
        """Print quality that the slicing stands for; "" where the name does not say."""
        return QUALITIES[self.slicing]

    def format(self) -> str:
        """The name in its normal form.

        >>> SpecimenName(23, "tri", "Y", 0.2, 3).format()
        '23 triY .2mm 3'
        """
        number = "" if self.iteration is None else str(self.iteration)
        shape, copy = _WORDS.get(self.shape, self.shape), str(self.replicate or "")
        words = (number, shape + self.axes, self._thickness(), copy, self.slicing)
        return " ".join(filter(None, (*words, self.place)))

    def _thickness(self) -> str:
        if self.size_mm is not None:
            return f"{self.size_mm:.0f}mm"
        return f"{_short(self.film_mm)}mm" if self.film_mm else ""


def _short(film_mm: float) -> str:
    """A film as names have it, always with its point: without one it is read as a lost point, or as no film."""
    text = f"{film_mm:.6f}".rstrip("0")
    return text.removeprefix("0") if film_mm < 1 else text + "0" * text.endswith(".")


@lru_cache(maxsize=1 << 14)
def parse(text: str) -> SpecimenName:
    """Read a specimen's name, misspelt ones too.

    Parameters
    ----------
    text : str
        The name as found.

    Raises
    ------
    BadInput
        The name cannot be read.

    Examples
    --------
    >>> parse("23 tri¥.2mm 3").name
    '23 triY .2mm 3'
    >>> parse("23 saXY").assumed
    ("'sa' read as sq", 'no film named: none')
    >>> parse("23-trix-d0.2-xtrafine-4").name
    '23 triX .2mm 4 xtrafine'
    """
    plain = _plain(text)
    head = _HEAD.match(plain)
    if not head:
        raise _unreadable(text, "no shape in it")
    shape = _SHAPES[head["shape"]]
    axes, doubts = _axes(text, shape, head["axes"], head["shape"])
    words = _rest(text, plain[head.end() :])
    film_mm, size_mm, more = _thickness(text, words.get("film"))
    slicing, read = _slicing(words.get("slicing"))
    place = words["place"]["letter"] if "place" in words else ""
    nowhere = f"'{place}' taken for a place on the plate (right, left or middle): not explained" if place else ""
    started = "" if head["iteration"] else "no iteration in the name"
    assumed = (started, *doubts, *_case(text, head["shape"]), *more, read, nowhere)
    return SpecimenName(
        iteration=int(head["iteration"]) if head["iteration"] else None,
        shape=shape,
        axes=axes,
        film_mm=film_mm,
        replicate=int(words["replicate"]["number"]) if "replicate" in words else None,
        slicing=slicing,
        place=place,
        size_mm=size_mm,
        raw=text,
        assumed=tuple(filter(None, assumed)),
    )


def _plain(text: str) -> str:
    """Small letters, one kind of blank; dashes and underscores part words as blanks do."""
    if len(text) > MAX_LETTERS:
        raise _unreadable(text, f"{len(text)} letters; expected at most {MAX_LETTERS}")
    # The yen sign and the letters' wide forms are what readers of scans make of plain ones.
    return re.sub(r"[\s_\u2010-\u2015-]+", " ", unicodedata.normalize("NFKC", text).lower()).strip().replace(",", ".")


def _unreadable(text: str, why: str) -> BadInput:
    return BadInput(f"{shown(text)} is no specimen's name ({why}); expected {GRAMMAR}")


def _axes(text: str, shape: str, letters: str, word: str) -> tuple[str, list[str]]:
    axes = letters.upper().translate(_LETTERS)
    doubts = ["'sa' read as sq"] if word == "sa" else []
    if axes != letters.upper():
        doubts.append(f"axes {letters.upper()} read as {axes}")
    if axes not in (*_AXES[shape], ""):
        raise _unreadable(text, f"{_WORDS[shape]} has the axes {' or '.join(_AXES[shape]) or 'none'}, not {axes}")
    if not axes and _AXES[shape] != ("",):
        doubts.append(f"no axes in the name: {' or '.join(_AXES[shape])} unknown")
    return axes, doubts


def _case(text: str, word: str) -> list[str]:
    return ["upper case read as the usual spelling"] if word.upper() in text and word not in ("sx60",) else []


def _rest(text: str, rest: str) -> dict[str, re.Match[str]]:
    """Words after the shape, each kind at most once, in any order, with or without blanks between."""
    words: dict[str, re.Match[str]] = {}
    at = 0
    while at < len(rest):
        if rest[at] == " ":
            at += 1
            continue
        kind, match = next(((k, m) for k, p in _REST.items() if (m := p.match(rest, at))), ("", None))
        if match is None:
            raise _unreadable(text, f"cannot read {shown(rest[at:])}")
        if kind in words:
            raise _unreadable(text, f"two words for its {kind}: {words[kind][0]!r} and {match[0]!r}")
        words[kind], at = match, match.end()
    return words


def _thickness(text: str, match: re.Match[str] | None) -> tuple[float | None, float | None, list[str]]:
    """Film, size that is no film, and what was assumed."""
    if match is None:
        return 0.0, None, [NO_FILM]
    written = match["number"] or match["bare"]
    value = float(written)
    if value > THICKEST_MM:
        raise _unreadable(text, f"a film of {value:g} mm; expected at most {THICKEST_MM:g} mm")
    if match["bare"] or "." in written:
        doubts = [f"{written}mm written {_short(value)}mm"] if value and written != _short(value) else []
        return value, None, doubts
    if value in (1.0, 2.0):
        return value / 10, None, [f"{written}mm read as .{written}mm: the point is lost"]
    if value < 1:
        return 0.0, None, []
    return None, value, [f"{written}mm is too thick for a film: taken for another size, the film is unknown"]


def _slicing(match: re.Match[str] | None) -> tuple[str, str]:
    if match is None:
        return "", ""
    prefix = match["word"] or ""
    word = "xtrafine" if "tra" in prefix else prefix + "fine"  # blanks are single ones by now
    doubt = f"'{match[0]}' read as {QUALITIES[word]}" if word in ("xfine", "xtrafine") else ""
    return word, doubt


def design_of(specimen: SpecimenName) -> Design | None:
    """The design that a name stands for, everything else at its default; None where the name lacks it.

    >>> design_of(parse("23 triY .2mm x fine")).name
    'triy-d0.2-extrafine'
    """
    filmless = not specimen.axes and not specimen.film_mm
    if specimen.film_mm is None or specimen.axes not in _AXES[specimen.shape]:
        return None
    if specimen.shape == "double" and not filmless:
        return None
    given: dict[str, float | str] = {} if filmless else {"dielectric_mm": specimen.film_mm}
    if specimen.axes:
        given["along"] = specimen.axes.lower()
    return make({"shape": specimen.shape, "parameters": given, "quality": specimen.quality or "fine"})


def named(design: Design, iteration: int, copy: int) -> SpecimenName:
    """The name of a copy of a design.

    Parameters
    ----------
    design : Design
        Whose shape, axes, film and quality the name tells; nothing else of it does.
    iteration, copy : int
        Its iteration, and which copy it is, from 1.

    Examples
    --------
    >>> named(make({"shape": "tri", "quality": "extrafine"}), 26, 3).name
    '26 triX .2mm 3 x fine'
    """
    params = design.params
    usual = design.shape == "reference" and params.dielectric_mm == _PLATE_MM  # type: ignore[attr-defined]
    film_mm = 0.0 if usual else float(getattr(params, "dielectric_mm", 0.0))
    return SpecimenName(
        iteration=iteration,
        shape=design.shape,
        axes=str(getattr(params, "along", "")).upper(),
        film_mm=round(film_mm, 6),
        replicate=copy,
        slicing={"fine": "fine", "extrafine": "x fine"}.get(design.layers.name, ""),
    )
