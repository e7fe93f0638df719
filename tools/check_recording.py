"""What keeping more of a delivery costs: ``decisions`` and ``full`` against ``events``.

Usage: python -m tools.check_recording [--stack NAME ...] [--episodes N] [--rounds N]

The deliveries 0, 1 ... of seed 0 are driven in this process with each kind of recording in turn,
after a round that compiles and fills caches. Processor time; a kind's cost is the least of its
rounds over the least of ``events``. Exit status 1 where ``full`` costs more than MOST.
"""

import sys
import tempfile
import time
from pathlib import Path

from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder
from harness.study.drive import TABLES, drive_missing
from harness.study.manifest import about, parameters
from harness.task.study import RECORDS, make_study
from tools.options import parsed

MOST = 0.25  # of the processor time without recording, that full may cost


def spent(stack: str, episodes: int, record: str) -> float:
    """Processor time [s] of driving and keeping the deliveries."""
    study = make_study(stacks=[stack], episodes=episodes, record=record, workers=1, world="easy")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run"
        create_run(path, about(study, []), parameters(study))
        began = time.process_time()
        with RunFolder(path, TABLES, study.total) as run:
            drive_missing(
                study, run, Workers(1, make_executor=InProcess), lambda finished, record: None
            )
        return time.process_time() - began


def main() -> None:
    stacks = ["nav2-gps-ekf", "paper-gps", "nav2-stock", "mpc-gps-ekf"]
    asked = parsed(__doc__, stack=stacks, episodes=1, rounds=5)
    costs = {}
    for stack in asked.stack:
        spent(stack, asked.episodes, RECORDS[-1])
        rounds = [
            [spent(stack, asked.episodes, record) for record in RECORDS]
            for _ in range(asked.rounds)
        ]
        least = [min(times) for times in zip(*rounds, strict=True)]
        told = ", ".join(
            f"{record} {100.0 * (each / least[0] - 1.0):+.0f} %"
            for record, each in zip(RECORDS[1:], least[1:], strict=True)
        )
        print(
            f"{stack}: events {least[0]:.2f} s, {told} (least of {asked.rounds}, {asked.episodes} "
            "deliveries)"
        )
        costs[stack] = least[RECORDS.index("full")] / least[0] - 1.0
    dear = [f"{stack} {100.0 * cost:.0f} %" for stack, cost in costs.items() if cost > MOST]
    sys.exit(f"full costs more than {100.0 * MOST:.0f} %: {', '.join(dear)}" if dear else 0)


if __name__ == "__main__":
    main()
