"""A zip whose bytes depend on its files only: no clock, no user, no operating system."""

import io
import zipfile
from collections.abc import Iterable

_UNIX = 3
_MODE = 0o100644 << 16  # a plain file, readable by all

# What any 3MF starts with: kinds of file, and which of them is the model.
_KINDS = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
<Default Extension="config" ContentType="application/xml"/>
</Types>
"""
_START = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" \
Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""


def pack(files: Iterable[tuple[str, Iterable[str]]]) -> bytes:
    """Zip a model and its side files as a 3MF, piece by piece, so that no whole text is held.

    Parameters
    ----------
    files : iterable of (str, iterable of str)
        Path inside the 3MF, and its text in pieces.

    Returns
    -------
    bytes
        The whole file. Equal input gives equal bytes under one version of zlib; another zlib may
        pack the same text into other bytes.
    """
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for path, pieces in (("[Content_Types].xml", [_KINDS]), ("_rels/.rels", [_START]), *files):
            entry = zipfile.ZipInfo(path)  # dated 1980-01-01, as far back as a zip goes
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, _UNIX, _MODE
            with archive.open(entry, "w") as stream:
                stream.writelines(piece.encode() for piece in pieces)
    return target.getvalue()
