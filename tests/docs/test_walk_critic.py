"""A stranger's walk: add a critic to DWB in a copy of the product; find it where critics show."""

import json
from pathlib import Path
from typing import Any

import pytest

from .blocks import ROOT
from .test_walks import Walk

pytestmark = pytest.mark.slow

DECLARATIONS = "navstack/params/dwb.py"
MODULE = "navstack/control/dwb/critics/calm_turns.py"

PARAMS = '''@dataclass(frozen=True, slots=True)
class CalmTurnsParams:
    """Turn calmly."""

    scale: float = 1.0
    calm_rate: float = 0.0  # [rad/s] that costs nothing


MODULE = "module"'''
FIELD = """    CalmTurns: CalmTurnsParams = _critic(CalmTurnsParams, "calm_turns")
    # this program's own
"""
CRITIC = '''"""Turn calmly."""

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import CalmTurnsParams, DwbParams
from navstack.types import FloatArray


class CalmTurnsCritic(Critic):
    """The yaw rate beyond a calm one."""

    def __init__(self, params: CalmTurnsParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._calm_rate = params.calm_rate

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """One cost [rad/s] per trajectory."""
        return np.maximum(np.abs(rollouts.commands[:, 2]) - self._calm_rate, 0.0)
'''

# Of a few coarse trajectories, so that a cycle is quick without compiled kernels.
DRIVE = """
import json, sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock
import numpy as np
from harness.explain.decision_words import shares_of
from harness.metrics.decisions import DecisionLog
from navstack.control.controller import Surroundings
from navstack.control.dwb.dwb_controller import DwbController
from navstack.costmap.costmap import Costmap
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_dwb
from navstack.types import Path as Plan, Pose2D, RobotState, Twist2D

footprint = np.array(((0.3, 0.2), (0.3, -0.2), (-0.3, -0.2), (-0.3, 0.2)))
around = Surroundings(Costmap(np.zeros((60, 60), dtype=np.uint8), 0.1, -3.0, -3.0))
along = np.linspace(0.0, 2.0, 11)
plan = Plan(np.column_stack((0.5 * along, along, np.full(11, 1.1))))
for file in sys.argv[1:]:
    params = replace(
        read_dwb(load_nav2(Path(file))), vx_samples=3, vtheta_samples=5, sim_time=0.4,
        linear_granularity=0.2, angular_granularity=0.4,
    )
    controller = DwbController(params, footprint, 10.0)
    command = controller.compute_velocity(RobotState(Pose2D(), Twist2D(0.3), 0.0), plan, around)
    decision = controller.last_decision
    best = decision.scores.best()
    log = DecisionLog()
    log.record(SimpleNamespace(decision=MagicMock(decision=controller.decision)))
    other = controller.alternatives[0]
    print(json.dumps({
        "turn": command.angular_z,
        "searched": [decision.choice.index, decision.choice.total],
        "scored": [best.index, best.total],
        "recorded": {each.critic: each.weighted for each in controller.decision.scores},
        "columns": list(log.columns),
        "shares": shares_of(log.rows[0]),
        "alternative": [each.critic for each in other.scores],
    }))
"""


class Grown(Walk):
    """A copy with the critic, and a Nav2 file that lists it."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        (folder / MODULE).write_text(CRITIC, encoding="utf-8")
        self.edit(
            DECLARATIONS,
            ('MODULE = "module"', PARAMS),
            ("    # this program's own\n", FIELD),
        )
        (folder / "params").symlink_to(ROOT / "params")
        (folder / "maps").symlink_to(ROOT / "maps")

    def nav2_file(self, name: str, line: str) -> str:
        """A Nav2 file with the critic and a line of its parameters."""
        text = (ROOT / "params" / "nav2" / "starter.yaml").read_text(encoding="utf-8")
        critics = '      critics: ["RotateToGoal",'
        assert text.count(critics) == 1
        path = self.folder / f"{name}.yaml"
        given = text.replace(critics, f'      {line}\n      critics: ["CalmTurns", "RotateToGoal",')
        path.write_text(given, encoding="utf-8")
        return str(path)

    def cycles(self, *scales: float) -> list[Any]:
        """One control cycle with the critic at each scale."""
        files = [self.nav2_file(f"{scale}", f"CalmTurns.scale: {scale}") for scale in scales]
        done = self.python("-c", DRIVE, *files)
        assert done.returncode == 0, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def grown(tmp_path_factory: pytest.TempPathFactory) -> Grown:
    return Grown(tmp_path_factory.mktemp("grown"))


def test_the_critic_takes_part_in_the_search_and_in_what_is_recorded(grown: Grown) -> None:
    hardly, strongly = grown.cycles(1e-6, 1e6)
    assert abs(strongly["turn"]) < 1e-9 < abs(hardly["turn"])
    for cycle in (hardly, strongly):
        assert cycle["searched"] == cycle["scored"]
        assert cycle["recorded"]["CalmTurns"] is not None
        assert "CalmTurns" in cycle["alternative"]
        assert {"CalmTurns_raw", "CalmTurns_weighted", "CalmTurns_rejected"} <= set(
            cycle["columns"]
        )
    assert hardly["recorded"]["CalmTurns"] == pytest.approx(1e-6 * abs(hardly["turn"]))
    assert 0.0 < hardly["shares"]["CalmTurns"] < 0.01


def test_lint_knows_the_critics_keys(grown: Grown) -> None:
    lines = {
        "known": "CalmTurns.calm_rate: 0.2",
        "misspelt": "CalmTurns.calm_rat: 0.2",
        "text": "CalmTurns.calm_rate: fast",
    }
    files = [grown.nav2_file(name, line) for name, line in lines.items()]
    done = grown.navbench(*(("lint", file) for file in files))
    assert [bool(status) for status, _ in done] == [False, False, True]
    known, misspelt, text = (" ".join(printed.split()) for _, printed in done)
    assert "CalmTurns is this program's own" in known and "calm_rat" not in known
    assert "did you mean 'calm_rate'" in misspelt
    assert "FollowPath.CalmTurns.calm_rate" in text
