"""Run a command in this process."""

import contextlib
import io
import sys

from sensorgen.cli import main


def run(folder, *words):
    """Exit code and standard output of a command in a folder."""
    return run_all(folder, *words)[:2]


def run_all(folder, *words):
    """Exit code, standard output and errors of a command in a folder."""
    argv, out, err = sys.argv, io.StringIO(), io.StringIO()
    sys.argv = ["sensorgen", *words]
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as left:
        assert "Traceback" not in err.getvalue()
        return left.code, out.getvalue(), err.getvalue()
    finally:
        sys.argv = argv
