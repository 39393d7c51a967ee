"""Shades for pages: colours of bodies on a light and a dark ground."""

LIGHT, DARK = "#ffffff", "#14171b"  # the page's grounds, as of page.css
LEAST = {LIGHT: 1.5, DARK: 3.2}  # contrast of a body with the ground, by WCAG 2 [-]
_APART = 0.2  # share of the ink that parts bodies of one material


def shades(colour: str, number: int) -> tuple[str, str]:
    """A material's colour for its ``number``-th body, on a light and on a dark ground.

    >>> shades("#303436", 0)
    ('#303436', '#66696a')
    """
    rgb = _rgb(colour)
    light, dark = _clear(rgb, LIGHT, 0.0), _clear(rgb, DARK, 255.0)
    towards = 255.0 if luminance(rgb) < 0.4 else 0.0
    return _hex(_moved(light, towards, number)), _hex(_moved(dark, towards, number))


def _moved(colour: tuple[float, ...], end: float, number: int) -> tuple[float, ...]:
    """The shade of the ``number``-th body."""
    share = min(_APART * number, 0.6)
    return tuple(v + (end - v) * share for v in colour)


def _clear(colour: tuple[float, ...], ground: str, end: float) -> tuple[float, ...]:
    """The colour moved towards black or white until it contrasts with the ground."""
    for step in range(101):
        moved = tuple(v + (end - v) * step / 100 for v in colour)
        if contrast(moved, _rgb(ground)) >= LEAST[ground]:
            return moved
    return colour


def contrast(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Contrast ratio of two colours, WCAG 2.2: (L1 + 0.05) / (L2 + 0.05), from 1 to 21 [-]."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: tuple[float, ...]) -> float:
    """Relative luminance of an sRGB colour of 0 to 255, WCAG 2.2 [-]."""
    linear = ((v / 255 / 12.92) if v / 255 <= 0.04045 else ((v / 255 + 0.055) / 1.055) ** 2.4 for v in colour)
    return sum(share * v for share, v in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(float(int(colour[k : k + 2], 16)) for k in (1, 3, 5))


def _hex(colour: tuple[float, ...]) -> str:
    return "#" + "".join(f"{round(v):02x}" for v in colour)
