"""Keeps in the state folder what must outlive the daemon, while it runs."""

import logging
import time
from collections.abc import Callable
from pathlib import Path

from touchd.align.alignment import KeptAlignment
from touchd.align.file import ALIGNMENT_FILE, load_alignment, save_alignment
from touchd.assemble import latest_fseq
from touchd.daemon import Daemon
from touchd.errors import StateError
from touchd.memory import give_back
from touchd.model import Sensor, Surface
from touchd.outputs.tuio import later_fseq
from touchd.pipeline import Pipeline
from touchd.state import FSEQ_FILE, SURFACE_FILE, FseqStore, camera_of_surface, load_surface, save_surface

log = logging.getLogger(__name__)

# The stored frame number is kept this far ahead of the one in use: about an hour at 30 Hz.
_FSEQ_AHEAD = 100_000


class Keeper:
    """Stores a new surface and the TUIO frame number. A folder that cannot be written to stops nothing, and says so."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._surface: Surface | None = None
        self._surface_since_s: float | None = None
        self._fseq = 0
        self._problem: str | None = None

    @property
    def problem(self) -> str | None:
        """Why something could not be stored, None if all is well."""
        return self._problem

    @property
    def surface_since_s(self) -> float | None:
        """When the surface in force was learned, in Unix time; None without one."""
        return self._surface_since_s

    def stored_surface(self, pipeline: Pipeline) -> Surface | None:
        """Return the stored surface if it fits the pipeline's source; say why if it does not."""
        path = self._folder / SURFACE_FILE
        if not path.exists():
            return None
        try:
            self._surface = load_surface(path, pipeline.sensor, pipeline.made_from)
            self._surface_since_s = path.stat().st_mtime
        except (StateError, OSError) as error:
            log.warning("%s", error)
            return None
        log.info("using the surface in %s", path)
        return self._surface

    def remembered_camera(self) -> str | None:
        """Return the serial number or place of the camera that the stored surface was made with; None without one."""
        return camera_of_surface(self._folder / SURFACE_FILE)

    def stored_alignment(self, sensor: Sensor) -> KeptAlignment | None:
        """Return the stored alignment if there is one for this sensor; say why if it cannot be used."""
        try:
            return load_alignment(self._folder / ALIGNMENT_FILE, sensor)
        except StateError as error:
            log.warning("%s", error)
            return None

    def keep_alignment(self, kept: KeptAlignment, sensor: Sensor) -> str | None:
        """Store an alignment; return its file, None if it cannot be written."""
        path = self._folder / ALIGNMENT_FILE
        self._try(lambda: save_alignment(path, kept, sensor), "the alignment is not kept")
        return str(path) if self._problem is None else None

    def stored_fseq(self) -> int:
        """Return the frame number to go on after."""
        return FseqStore(self._folder / FSEQ_FILE).load()

    def look(self, daemon: Daemon) -> None:
        """Store what is new. Called on the main thread a few times a second."""
        ready = daemon.pipeline.ready
        if ready is not None and ready.surface is not self._surface:
            self._surface = surface = ready.surface
            self._surface_since_s = time.time()
            for line in ready.lines():
                log.info("%s", line)
            self._try(lambda: save_surface(self._folder / SURFACE_FILE, surface), "the surface is not kept")
            give_back()
        fseq = latest_fseq(daemon.outputs)
        if later_fseq(fseq + _FSEQ_AHEAD // 2, self._fseq) != self._fseq:
            self.keep_fseq(fseq + _FSEQ_AHEAD)

    def keep_fseq(self, fseq: int) -> None:
        """Store a frame number."""
        self._fseq = fseq
        self._try(lambda: FseqStore(self._folder / FSEQ_FILE).keep(fseq), "the TUIO frame number is not kept")

    def _try(self, write: Callable[[], None], otherwise: str) -> None:
        try:
            write()
        except StateError as error:
            self._problem = f"{otherwise}: {error}"
            log.warning("%s", self._problem)
        else:
            self._problem = None
