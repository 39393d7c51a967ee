"""build123d in a process of its own, which loads it while this one does other things.

::

    with CadProcess() as cad:                       # begins to load build123d at once
        ...                                         # design, meshes, checks
        step = cad.submit(scene, colours, title, path)
        ...                                         # 3MF, profiles, prediction
        step.result()                               # the file is there, or CadFailed says why not

Nothing here imports it, and no other user of the kernel shares the process.
"""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import CadFailed, SensorgenError
from sensorgen.core.worker import Worker, WorkerEnded
from sensorgen.scene.scene import Scene

if TYPE_CHECKING:
    from sensorgen.scene.geometry.mesh_files import FileBody

# Import and work take 1.5 s together; a cold disk, a slow machine and a large sensor may need twenty times as much.
TIMEOUT_S = 300.0
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
        self._worker = Worker("the CAD process", WORKER, timeout_s)
        self._thread = ThreadPoolExecutor(1, "cad")  # sends and waits, so that the caller need not

    def __enter__(self) -> "CadProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self._worker.process.kill()
        self._thread.shutdown(cancel_futures=True)
        self._worker.stop()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._worker.process.pid

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
        """Have a STEP file read and wait for it; as of :func:`sensorgen.scene.geometry.solids.read_step`."""
        return list(self._thread.submit(self._exchange, "read_step", path.absolute(), chord_mm).result())

    def _exchange(self, name: str, *arguments: Any) -> Any:
        """Send one job and wait for its answer."""
        try:
            answer = self._worker.ask((name, arguments))
        except WorkerEnded as error:
            raise CadFailed(str(error)) from None
        if isinstance(answer, SensorgenError):
            raise answer
        return answer
