"""Labels for the specimens of a batch: a page to print on A4, each with a QR code that holds its name."""

import html
from collections.abc import Iterable
from dataclasses import dataclass

from sensorgen.core.errors import MissingValue
from sensorgen.workflows.batch.pieces import PrintPiece

_STYLE = """
@page { size: A4; margin: 10mm }
body { margin: 0; font: 10pt/1.25 system-ui, sans-serif; color: #000; background: #fff }
main { display: grid; grid-template-columns: repeat(2, 90mm); gap: 1.5mm 4mm }
section { display: flex; gap: 3mm; align-items: center; height: 25mm; width: 90mm; box-sizing: border-box;
          border: 0.2mm dashed #777; padding: 1.5mm; break-inside: avoid; overflow: hidden }
svg { width: 22mm; height: 22mm; flex: none }
h2 { font-size: 12pt; margin: 0 0 1mm; overflow-wrap: anywhere }
p { margin: 0; font-size: 8pt; overflow-wrap: anywhere }
h1 { font-size: 11pt; margin: 0 0 3mm }
"""


@dataclass(frozen=True)
class Label:
    """Content of one label.

    Attributes
    ----------
    name : str
        The specimen's.
    batch, design, design_id : str
        Name of the batch, and name and hash of the design.
    place : int
        Its number on the plate.
    log_head : str
        Identity of the last record of the log then, which anchors the predictions in it; "" without a log.
    """

    name: str
    batch: str
    design: str
    design_id: str
    place: int
    log_head: str = ""

    @classmethod
    def of(cls, piece: PrintPiece, batch: str, place: int, log_head: str = "") -> "Label":
        """The label of a specimen."""
        return cls(piece.name, batch, piece.design.name, piece.design_id, place, log_head)

    @property
    def code(self) -> str:
        """Content of the QR code: the name first, then batch and design, a line each."""
        return f"{self.name}\n{self.batch}\n{self.design_id}"


def page(labels: Iterable[Label], title: str) -> str:
    """HTML of a page of labels; it needs nothing but itself.

    Parameters
    ----------
    labels : iterable of Label
        In the order of the plate.
    title : str
        Name of the batch.

    Raises
    ------
    MissingValue
        The library for QR codes is not installed.
    """
    head = f'<meta charset="utf-8"><title>{html.escape(title)}: labels</title><style>{_STYLE}</style>'
    body = "".join(map(_section, labels))
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body><h1>{html.escape(title)}</h1>\n'
        f"<main>{body}\n</main></body></html>\n"
    )


def _section(label: Label) -> str:
    log_head = f"log {label.log_head[:16]}" if label.log_head else ""
    lines = (f"no. {label.place} on the plate of {label.batch}", label.design, f"design {label.design_id}", log_head)
    text = "".join(f"<p>{html.escape(line)}</p>" for line in lines if line)
    return f"\n<section>{_qr(label.code)}<div><h2>{html.escape(label.name)}</h2>{text}</div></section>"


def _qr(text: str) -> str:
    """A QR code as SVG; error correction M bears a scratch or a stain."""
    try:
        import segno
    except ImportError:
        raise MissingValue(
            "QR codes need the library segno: pip install segno, or set 'labels: {sheet: false}' in the plan"
        ) from None
    return str(segno.make(text, error="m", micro=False).svg_inline(border=4, omitsize=True))
