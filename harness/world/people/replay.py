"""People as they were recorded."""

import numpy as np

from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import PedestrianModel
from harness.world.people.replay_file import Recording, load_recording
from harness.world.people.walk_kernels import replay
from harness.world.physics.body_state import BodyState
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.geometry import relative_to, transform_points
from navstack.types import FloatArray, Pose2D


class ReplayPedestrians(PedestrianModel):
    """Everybody walks as recorded, and is absent before the first sample and after the last.

    Between two samples they walk straight at constant speed. Who would appear within
    ``start_clearance`` of the robot stays absent until the recording lets him go. Nobody reacts to
    the robot: the people of the recording never saw it.
    """

    def __init__(self, params: PedestrianParams, walkable: OccupancyGrid) -> None:
        """Read the recording.

        Args:
            params: which recording, and where it is put.
            walkable: the map; that people walk on free cells only is the user's business.

        Raises:
            InputError: the recording is missing, bad, or lies off the map.
        """
        self._recording = load_recording(params.replay)
        _check_place(self._recording, walkable)
        self._loop = params.replay.loop and self._recording.duration > 0.0
        self._clearance = params.start_clearance
        self._time = 0.0  # [s] of the recording
        n = self._recording.count
        self._absent = np.ones(n, dtype=np.bool_)  # in the recording
        self._hidden = np.zeros(n, dtype=np.bool_)
        self._robot = (0.0, 0.0)  # [m] map frame
        self._states = np.zeros((n, 4))

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`; a loop is joined at a random moment."""
        self._time = 0.0
        if self._loop:
            self._time = float(rng.uniform(0.0, self._recording.duration))
        self._absent[:] = True
        self._hidden[:] = False
        self._robot = (robot.x, robot.y)
        self._show()

    def see_robot(self, robot: BodyState) -> None:
        """See :class:`PedestrianModel`; nobody appears where the robot is."""
        self._robot = (robot.x, robot.y)

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        self._time += dt
        if self._loop and self._time > self._recording.duration:
            self._time -= self._recording.duration
            self._absent[:] = True  # who is there at both ends of the recording appears anew
        self._show()

    def _show(self) -> None:
        recording, states = self._recording, np.empty_like(self._states)
        replay(
            self._time,
            recording.firsts,
            recording.times,
            recording.positions,
            *self._robot,
            self._clearance,
            self._absent,
            self._hidden,
            states,
        )
        self._states = states


def _check_place(recording: Recording, grid: OccupancyGrid) -> None:
    """Check that somebody comes upon the map.

    Raises:
        InputError: nobody does.
    """
    on_grid = (
        transform_points(relative_to(grid.origin, Pose2D()), recording.positions) / grid.resolution
    )
    if ((on_grid >= 0.0) & (on_grid < (grid.width, grid.height))).all(axis=1).any():
        return
    (x0, y0), (x1, y1) = recording.positions.min(axis=0), recording.positions.max(axis=0)
    raise InputError(
        f"the recorded people walk at x {x0:.1f}..{x1:.1f}, y {y0:.1f}..{y1:.1f} m, off the map of "
        f"{grid.width * grid.resolution:.0f} m x {grid.height * grid.resolution:.0f} m with its "
        "corner at "
        f"({grid.origin.x:.1f}, {grid.origin.y:.1f}) m; give replay.placement in the world file"
    )
