"""Tell whether a path is on a file system on which locks of several machines or mounts are not reliable."""

import os
import sys
from pathlib import Path

# Types in /proc/self/mountinfo: shares, and folders of another machine or program by FUSE; fuseblk is a local disk.
_SHARED = (
    "nfs", "nfs4", "cifs", "smb3", "smbfs", "ncpfs", "afs", "9p", "vboxsf", "vmhgfs", "prl_fs", "ceph", "glusterfs",
    "lustre", "gpfs", "ocfs2", "gfs2", "davfs", "fuse",
)  # fmt: skip
_REMOTE_DRIVE = 4  # GetDriveTypeW of Windows


def without_locks(path: Path) -> str:
    """Name of the file system of a path where it is shared, so that SQLite's locks may not work; else "".

    Parameters
    ----------
    path : Path
        Need not exist. On systems other than Linux and Windows always "".
    """
    if sys.platform == "win32":
        return _windows(path)
    try:
        mounts = Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape").splitlines()
    except OSError:  # not Linux
        return ""
    real = os.path.realpath(path.parent)
    found = ("", "")
    for line in mounts:
        before, _, after = line.partition(" - ")
        point = before.split()[4].encode("utf-8", "surrogateescape").decode("unicode_escape")
        if real == point or real.startswith(point.rstrip("/") + "/"):
            found = max(found, (point, after.split()[0]), key=lambda mount: len(mount[0]))
    kind = found[1]
    return f"{kind} at {found[0]}" if kind.partition(".")[0] in _SHARED else ""


def _windows(path: Path) -> str:
    import ctypes

    anchor = path.absolute().anchor
    if anchor.startswith("\\\\"):
        return f"the share {anchor}"
    remote = ctypes.windll.kernel32.GetDriveTypeW(anchor) == _REMOTE_DRIVE  # type: ignore[attr-defined,unused-ignore]
    return f"the network drive {anchor}" if remote else ""
