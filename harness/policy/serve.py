"""The process of a policy: ``python -m harness.policy.serve FD`` answers over a pipe."""

import importlib
import importlib.util
import os
import pickle
import signal
import socket
import sys
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from harness.policy.answers import packed, packed_error

LOOK = 2.0  # [s] between two looks at whether the program that asks is still there


def load(policy: str, file: str) -> Any:
    """Make a policy.

    Args:
        policy: MODULE:CLASS or FILE.py:CLASS; what stands beside that file can be imported by it.
        file: that it is made with; empty: without.
    """
    where, _, name = policy.rpartition(":")
    if where.endswith(".py"):
        module = _module_of_file(Path(where))
    else:
        module = importlib.import_module(where)
    make = getattr(module, name)
    if file:
        return make(file)
    return make()


def _module_of_file(path: Path) -> ModuleType:
    sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = sys.modules[path.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def serve(connection: socket.socket) -> None:
    """Answer until nobody asks any more."""
    policy: Any = None
    asked = connection.makefile("rb")
    while True:
        try:
            what, given = pickle.load(asked)
        except (EOFError, OSError):
            return
        try:
            answer = None
            if what == "load":
                policy = load(*given)
            elif what == "reset":
                policy.reset(given)
            else:
                answer = np.asarray(policy.act(given), dtype=np.float64)
            message = packed(answer)
        except Exception as error:  # whatever the user's code raises
            message = packed_error(f"{type(error).__name__}: {error}")
        connection.sendall(message)


def _end_with_parent() -> None:
    """End when the program that asks is gone, even while the policy hangs."""
    parent = os.getppid()
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(1)


def main() -> None:
    """Serve at the file descriptor that is given; what the policy prints goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the program that asks decides
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    serve(socket.socket(fileno=int(sys.argv[1])))


if __name__ == "__main__":
    main()
