"""build123d in a process of its own, which loads it while this one does other things.

::

    with CadProcess() as cad:                       # begins to load build123d at once
        ...                                         # design, meshes, checks
        step = cad.submit(scene, colours, title, path)
        ...                                         # 3MF, profiles, prediction
        step.result()                               # the file is there, or CadFailed says why not

Nothing here imports it, and no other user of the kernel shares the process.
"""

import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import CadFailed, SensorgenError
from sensorgen.scene.scene import Scene

if TYPE_CHECKING:
    from sensorgen.scene.geometry.mesh_files import FileBody

# Import and work take 4 s together; a cold disk, a slow machine and a large sensor may need twenty times as much.
TIMEOUT_S = 300.0
GRACE_S = 5.0  # from the end of its output to the end of the process
WORKER = ("-P", "-m", "sensorgen.scene.geometry.solids")  # -P: no module of the user's current folder takes part


class CadProcess:
    """A process that writes and reads STEP files, one after the other.

    It starts with the object and is gone after the ``with`` block, whatever happens in there. When this process is
    killed, the other one reads the end of its input and leaves too.
    """

    def __init__(self, timeout_s: float = TIMEOUT_S) -> None:
        """Start the process.

        Parameters
        ----------
        timeout_s : float
            How long one file may take, including what is left of loading build123d [s].
        """
        self.timeout_s = timeout_s
        self._late = False
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed in __exit__; a pipe nobody reads would fill up)
        self._process = subprocess.Popen(  # noqa: S603  (this Python, and a module of our own)
            [sys.executable, *WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said
        )
        self._thread = ThreadPoolExecutor(1, "cad")  # sends and waits, so that the caller need not

    def __enter__(self) -> "CadProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()  # it holds nothing that needs closing, and Python's own way out takes a second
        self._thread.shutdown(cancel_futures=True)
        self._process.communicate()
        self._said.close()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def submit(self, scene: Scene, colours: Mapping[str, str], title: str, path: Path) -> Future[None]:
        """Have a STEP file written; returns at once.

        Parameters
        ----------
        scene : Scene
            What to write.
        colours : mapping of str to str
            Colour of each body by its name, as in "#202428".
        title : str
            Name of the assembly.
        path : Path
            Where. The file is complete when the result is there: give a temporary path, and rename it then.

        Returns
        -------
        Future of None
            ``result()`` waits for the file. It raises CadFailed where the kernel cannot make a body, where the
            process ended or where it took longer than ``timeout_s``, and Unwritable where the file cannot be written.
        """
        return self._thread.submit(self._exchange, "write_step", scene, dict(colours), title, path.absolute())

    def write_step(self, scene: Scene, colours: Mapping[str, str], title: str, path: Path) -> None:
        """Have a STEP file written and wait for it; arguments and errors as in ``submit``."""
        self.submit(scene, colours, title, path).result()

    def read_step(self, path: Path, chord_mm: float) -> "list[FileBody]":
        """Have a STEP file read and wait for it; as of :func:`sensorgen.scene.geometry.step_files.read_step`."""
        return list(self._thread.submit(self._exchange, "read_step", path.absolute(), chord_mm).result())

    def _exchange(self, name: str, *arguments: Any) -> Any:
        """Send one job and wait for its answer."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None  # noqa: PT018, S101  (both are pipes, see above)
        clock = threading.Timer(self.timeout_s, self._expire)
        clock.start()
        try:
            stdin.write(pickle.dumps((name, arguments)))
            stdin.flush()
            answer = pickle.load(stdout)  # noqa: S301  (from the process that we started)
        except (OSError, EOFError, pickle.UnpicklingError):
            raise CadFailed(self._obituary()) from None
        finally:
            clock.cancel()
        if isinstance(answer, SensorgenError):
            raise answer
        return answer

    def _expire(self) -> None:
        self._late = True
        self._process.kill()

    def _obituary(self) -> str:
        """Why there is no answer."""
        if self._late:
            return f"the CAD process took more than {self.timeout_s:g} s and was stopped: try a smaller one, or again"
        try:
            code = self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return "the CAD process gave an answer that cannot be read, and was stopped"
        if code < 0:
            return f"the CAD process was ended by {signal.Signals(-code).name}: there may be too little memory"
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").splitlines()
        last = next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")
        return f"the CAD process ended with exit code {code}: {last}"
