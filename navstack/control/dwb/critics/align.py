"""Keep the robot's nose near the plan (PathAlign) and drive it to the plan's end (GoalAlign)."""

from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.pose_score import GOAL_ALIGNMENT, PATH_ALIGNMENT
from navstack.control.dwb.scene import DwbScene


class PathAlignCritic(MapGridCritic):
    """After ``path_align.cpp``: distance of the nose to the plan."""

    kind = PATH_ALIGNMENT

    def scale(self, scene: DwbScene) -> float:
        """0 near the goal, where aligning the nose would destabilise."""
        dx = scene.pose.x - scene.goal.x
        dy = scene.pose.y - scene.goal.y
        if dx * dx + dy * dy <= self.measured.nose * self.measured.nose:
            return 0.0
        return super().scale(scene)


class GoalAlignCritic(MapGridCritic):
    """After ``goal_align.cpp``: distance of the nose to where it will be at the plan's end."""

    kind = GOAL_ALIGNMENT
