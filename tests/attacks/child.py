"""Refusals of sensorgen in a process with little memory."""

ADDRESSES = 2 << 30  # bytes: libraries and files on the disk count, too


def refused(done):
    """The one line with which it was refused."""
    assert done.code == 2, (done.code, done.err)
    (line,) = done.err.splitlines()
    assert line.startswith("sensorgen: "), line
    assert "please report" not in line
    return line
