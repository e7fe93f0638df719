"""A policy in a process of its own: it may crash or hang, and only its delivery is lost.

That protects from accidents. A policy that wants to do harm can do what its user can.
"""

import contextlib
import os
import pickle
import socket
import subprocess
import sys
import time
import weakref
from typing import Any

from harness.policy.answers import AnswerError, received
from harness.policy.interface import PolicyError, PolicyObservation
from harness.storage.texts import clean_text
from harness.task.stack import PolicyParams
from navstack.types import FloatArray

# unless the user says otherwise
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
PATIENCE = 5.0  # [s] for a process to end


class PolicyProcess:
    """Starts when it is asked first, and again after it was lost."""

    def __init__(self, policy: str, params: PolicyParams) -> None:
        """Start nothing yet.

        Args:
            policy: MODULE:CLASS or FILE.py:CLASS.
            params: time limits, and the file that it is made with.
        """
        self._policy, self._params = policy, params
        self._process: subprocess.Popen[bytes] | None = None

    def reset(self, seed: int) -> None:
        """Begin a delivery, see :class:`harness.policy.interface.Policy`.

        Raises:
            PolicyError: the policy cannot be loaded, fails or does not answer in time.
        """
        self.start()
        self._ask("reset", seed, self._params.time_limit)

    def act(self, observation: PolicyObservation) -> FloatArray:
        """The policy's answer, a velocity (2,) or waypoints (k, 2).

        Raises:
            PolicyError: it fails, does not answer in time, or what it answers is neither.
        """
        answer = self._ask("act", observation, self._params.time_limit)
        if answer is None:
            raise self._lost("answered nothing where it was asked to act")
        return answer

    def start(self) -> None:
        """Load the policy, unless it is there.

        Raises:
            PolicyError: it cannot be loaded.
        """
        if self._process is not None and self._process.poll() is None:
            return
        ours, theirs = socket.socketpair()
        with theirs:
            command = [sys.executable, "-m", "harness.policy.serve", str(theirs.fileno())]
            paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
            environment = {**dict.fromkeys(ONE_THREAD, "1"), **os.environ, "PYTHONPATH": paths}
            self._process = subprocess.Popen(
                command,
                pass_fds=[theirs.fileno()],
                env=environment,
                stdin=subprocess.DEVNULL,
            )
        self._connection = ours
        self._end = weakref.finalize(self, _end, self._process, ours)
        try:
            self._ask("load", (self._policy, self._params.file), self._params.start_limit)
        except PolicyError:
            self.close()  # the next delivery tries again
            raise

    def _ask(self, what: str, given: Any, limit: float) -> FloatArray | None:
        """Send a request and wait for its answer; None: it was done.

        Raises:
            PolicyError: there is none that is whole in time, or it is an error.
        """
        self._deadline = time.monotonic() + limit
        try:
            self._require_silence()
            self._connection.settimeout(limit)
            self._connection.sendall(pickle.dumps((what, given)))
            answer = received(self._read)
        except AnswerError as error:
            raise self._lost(f"answered with {error}") from None
        except TimeoutError:
            raise self._lost(
                f"did not answer within {limit:g} s (policy: time_limit and start_limit of the "
                "stack)"
            ) from None
        except OSError:
            raise self._lost(f"ended while it was asked to {what}{self._status()}") from None
        if isinstance(answer, str):
            raise PolicyError(clean_text(f"policy {self._policy}: {what}: {answer}"))
        return answer

    def _require_silence(self) -> None:
        """Check that nothing is left of an earlier answer, which would be taken for the next one.

        Raises:
            AnswerError: something is.
        """
        self._connection.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            if self._connection.recv(1, socket.MSG_PEEK):
                raise AnswerError("more bytes than one answer")

    def _read(self, size: int) -> bytes:
        """So many bytes of an answer.

        Raises:
            TimeoutError: they are not there in time.
            OSError: they never will be.
        """
        content = bytearray()
        while len(content) < size:
            left = self._deadline - time.monotonic()
            if left <= 0.0:
                raise TimeoutError
            self._connection.settimeout(left)
            part = self._connection.recv(size - len(content))
            if not part:
                raise ConnectionError
            content += part
        return bytes(content)

    def _status(self) -> str:
        """How the process ended, if it does so soon."""
        assert self._process is not None
        with contextlib.suppress(subprocess.TimeoutExpired):
            return f", with status {self._process.wait(PATIENCE)}"
        return ""

    def _lost(self, why: str) -> PolicyError:
        self.close()
        return PolicyError(clean_text(f"policy {self._policy} {why}"))

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._end()
            self._process = None


def _end(process: "subprocess.Popen[bytes]", connection: socket.socket) -> None:
    connection.close()
    process.kill()
    process.wait()
