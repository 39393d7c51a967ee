"""A change that was tried, written into the design's file."""

from pathlib import Path

from sensorgen.core import files, yamlfile
from sensorgen.core.errors import BadInput
from sensorgen.design.design import Design, load, make
from sensorgen.workflows.changes import TriedChange


def apply(path: Path, design: Design, change: TriedChange) -> None:
    """Write a change into a design file, as a whole or not at all; comments and order stay.

    Parameters
    ----------
    path : Path
        The file.
    design : Design
        What the change was tried on.
    change : TriedChange
        What to write.

    Raises
    ------
    BadInput
        The file holds another design, as with options beside it, or cannot be changed in place.
    """
    if load(path).id() != design.id():
        raise BadInput(f"--apply: options change {path} too; expected the file alone: write them into it first")
    text = yamlfile.text(path)
    values = {tuple(one.key.split(".")): one.after for one in change.changes}
    edited = yamlfile.changed(text, values, str(path))
    if make({"name": path.stem} | yamlfile.parse(edited, str(path)), str(path)).id() != change.trial.design:
        raise BadInput(f"--apply: {path} would not become the design that was tried: edit it by hand")
    start = b"\xef\xbb\xbf" if path.read_bytes().startswith(b"\xef\xbb\xbf") else b""
    files.replace(path, start + edited.encode())
