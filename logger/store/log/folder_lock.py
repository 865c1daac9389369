"""One writer to a folder of logs. A second service, or a replay into the same folder, would finish the open files of
the first; so a process that writes holds a lock on the folder for as long as the process lives. The kernel lets go of
it when the process ends, however it ends."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from types import TracebackType

from logger.errors import BadInput


class FolderLock:
    """Holds ``folder``, which exists, until the end of the ``with`` block. Raises BadInput when another holds it."""

    def __init__(self, folder: Path) -> None:
        self._descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._descriptor)
            raise BadInput(
                f"{folder}: another ridelog writes here (see ridelog status); expected a folder of its own"
            ) from None

    def __enter__(self) -> FolderLock:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._descriptor)
