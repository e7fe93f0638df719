"""The Dask cluster that a page starts.

Its own commands, with this machine in place of the page's.
"""

import socket
import subprocess
import sys
from pathlib import Path
from types import TracebackType

import pytest

from .shortened import AT_MOST

DASK = Path(sys.executable).parent / "dask"
HOST, PORT = "HOST", "8786"  # as pages write them
SOON = 30.0  # [s] that a process may take to end


class Cluster:
    """Starts schedulers and workers in processes of their own, and ends them.

    Without such commands does nothing.
    """

    def __init__(self, folder: Path) -> None:
        """``folder``: where the commands are executed, and keep what they write."""
        self._folder = folder
        self._port = ""
        self._started: list[subprocess.Popen[bytes]] = []

    def start(self, words: tuple[str, ...]) -> None:
        """Execute ``dask scheduler`` or ``dask worker``, which go on until the cluster is left."""
        pytest.importorskip(
            "distributed", reason="the package distributed (extra 'dask') is not installed"
        )
        here = self.here(words[1:])
        for option in set(here) & set(AT_MOST):
            here[here.index(option) + 1] = str(AT_MOST[option])
        here += ["--host", "127.0.0.1"]
        here += (
            ["--dashboard-address", "127.0.0.1:0"] if here[0] == "scheduler" else ["--no-dashboard"]
        )
        log = (self._folder / f"{here[0]}.log").open("wb")
        with log:
            self._started.append(
                subprocess.Popen([DASK, *here], cwd=self._folder, stdout=log, stderr=log)
            )

    def here(self, words: tuple[str, ...]) -> list[str]:
        """The words of a command with the address of this machine."""
        result = []
        for word in words:
            if word == PORT or f"{HOST}:{PORT}" in word:
                self._port = self._port or free_port()
                word = word.replace(HOST, "127.0.0.1").replace(PORT, self._port)
            result.append(word)
        return result

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the processes, workers first."""
        for process in reversed(self._started):
            process.terminate()
        for process in reversed(self._started):
            process.wait(SOON)


def free_port() -> str:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])
