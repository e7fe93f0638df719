"""PyBullet, silenced: what it prints from C on standard output would spoil ``--json``."""

import contextlib
import importlib
import os
import sys
import threading
import weakref
from collections.abc import Iterator
from types import ModuleType
from typing import Any

_STREAMS = threading.RLock()  # held while they lead to nowhere: they are all threads'


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Send what C code writes to standard output and standard error to nowhere."""
    with _STREAMS:
        sys.stdout.flush()
        sys.stderr.flush()
        saved = os.dup(1), os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(saved[0], 1)
            os.dup2(saved[1], 2)
            for descriptor in (*saved, nowhere):
                os.close(descriptor)


def _import_quietly() -> ModuleType:
    with quiet():
        return importlib.import_module("pybullet")


bullet = _import_quietly()


class Server:
    """A physics server inside this process, freed with the last reference at the latest."""

    def __init__(self) -> None:
        """Open it.

        Raises:
            RuntimeError: PyBullet has no server left.
        """
        with quiet():
            # number for PyBullet's physicsClientId
            self.client = int(bullet.connect(bullet.DIRECT))
        if self.client < 0:
            raise RuntimeError(
                "PyBullet cannot open another physics server; close worlds that are no longer used"
            )
        self._finalizer = weakref.finalize(self, bullet.disconnect, self.client)

    def empty(self, dt: float, iterations: int, erp: float) -> None:
        """Remove everything; from then on there is no gravity.

        Args:
            dt: [s] of a step.
            iterations: of the contact solver per step.
            erp: [-] share of a penetration that it removes per step.
        """
        bullet.resetSimulation(physicsClientId=self.client)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=dt,
            numSubSteps=0,
            numSolverIterations=iterations,
            contactERP=erp,
            erp=erp,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        bullet.setGravity(0.0, 0.0, 0.0, physicsClientId=self.client)

    def close(self) -> None:
        """Free it; once more is no harm."""
        self._finalizer()


def set_dynamics(client: int, body: int, **dynamics: Any) -> None:
    """Set what PyBullet's ``changeDynamics`` knows of a body that moves without damping."""
    bullet.changeDynamics(
        body,
        -1,
        linearDamping=0.0,
        angularDamping=0.0,
        physicsClientId=client,
        **dynamics,
    )
