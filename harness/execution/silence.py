"""Whether a process still works: one that was stopped or waits in vain takes no processor time."""

import time
from pathlib import Path

# [s] without any processor time after which a process is given up; a delivery takes it all the time
SILENCE = 45.0
# [s] between two looks; more: this program was stopped itself, and nothing is known
LONGEST_LOOK = 5.0


class Pulse:
    """Watches one process."""

    def __init__(self) -> None:
        self._taken: float | None = None
        self._since = self._looked = time.monotonic()

    def is_silent(self, pid: int | None) -> bool:
        """Whether the process has done nothing for ``SILENCE``; to be asked about once a second.

        Where there is no ``/proc``, nothing is known and nobody is silent.
        """
        now, taken = time.monotonic(), processor_time(pid)
        if taken is None or taken != self._taken or now - self._looked > LONGEST_LOOK:
            self._taken, self._since = taken, now
        self._looked = now
        return now - self._since > SILENCE


def processor_time(pid: int | None) -> float | None:
    """What a process and its ended children have taken [clock ticks]; None: that cannot be told."""
    try:
        fields = (
            Path(f"/proc/{pid}/stat")
            .read_text(encoding="ascii", errors="replace")
            .rpartition(")")[2]
            .split()
        )
        # utime, stime, cutime, cstime (proc_pid_stat(5))
        return sum(float(field) for field in fields[11:15])
    except (OSError, ValueError):
        return None
