"""The physical world: one robot among people and street furniture, in PyBullet."""

import math
from collections.abc import Mapping

import numpy as np

from harness.task.mission import Mission
from harness.world.cargo.bucket_motion import BucketMotion
from harness.world.cargo.loose_cargo import make_cargo
from harness.world.map.scene import Scene
from harness.world.people.crowd import Crowd
from harness.world.people.pedestrians import PedestrianModel
from harness.world.physics.bodies import NearObstacles, add_robot, put_robot, static_index
from harness.world.physics.body_state import BodyState
from harness.world.physics.command_delay import CommandDelay
from harness.world.physics.contacts import ContactBook, ContactPoint, Motion, contact_points
from harness.world.physics.drive_kernels import drive_constants, drive_forces
from harness.world.physics.elevation import elevation_of
from harness.world.physics.engine import Server, bullet
from harness.world.physics.footing import ON_LEVEL_GROUND, Feet
from harness.world.physics.ground import Ground
from harness.world.physics.impulse_limit import limited, shove
from harness.world.physics.motion_kernels import base_state
from harness.world.physics.robot import SKID, RobotParams
from harness.world.physics.skid_kernels import skid_constants, skid_forces
from harness.world.sensors.suite import SensorSuite
from harness.world.truth import Truth
from harness.world.world import Legacy, World
from harness.world.world_params import WorldParams
from navstack.types import Observation, Pose2D, Twist2D

_OBSTACLE_FRICTION = 0.6  # [-] Coulomb coefficient of walls and furniture
# Beyond these the loads of the wheels are measured.
_LEVEL_SINE_SQUARED = 0.002 * 0.002  # [-] of half the tilt: 0.23 degrees
_LEVEL_SPIN_SQUARED = 0.02 * 0.02  # [rad2/s2] of rolling and pitching: 0.02 rad/s
_MAP_FRAME = bullet.WORLD_FRAME
_SLACK = 1e-6  # [m] by which rounding must not make a place clear


class PyBulletWorld(World):
    """Steps rigid bodies at the physics rate; a tick is a fixed number of physics steps.

    Simplifications: the ground is level but for vertical steps (:class:`Ground`); robot and
    furniture are rigid and collide without rebound; people are upright capsules (:class:`Crowd`);
    the drive is :func:`drive_forces` or :func:`skid_forces`. The robot is driven by forces, so
    that impacts push it about and can tip it.
    """

    def __init__(
        self,
        scene: Scene,
        robot: RobotParams,
        params: WorldParams,
        pedestrians: PedestrianModel,
        sensors: SensorSuite,
        steps_per_tick: int,
    ) -> None:
        """Build a world to be reset; call :meth:`close` when it is no longer needed.

        Args:
            scene: what stands in it.
            robot: its body and drive.
            params: physics, people, contacts and cargo.
            pedestrians: how people walk.
            sensors: of the robot.
            steps_per_tick: physics steps per :meth:`step`.
        """
        self._robot = robot
        self._params = params
        self._pedestrians = pedestrians
        self._sensors = sensors
        self._steps_per_tick = steps_per_tick
        self._index = static_index(scene)
        self._elevation = elevation_of(scene)
        self._has_steps = not self._elevation.is_flat
        self._server = Server()
        self._client = self._server.client
        self._dt = 1.0 / params.physics.rate  # [s]
        self._forces, self._constants_of = drive_forces, drive_constants
        if robot.steering == SKID:
            self._forces, self._constants_of = skid_forces, skid_constants
        self._commands = CommandDelay(robot.compute_latency, self._dt)
        x, y, z = robot.center_of_mass
        self._base_offset = (-x, -y, -z)  # from the centre of mass
        self._feet = Feet(robot, params.physics.gravity)
        self._reach = robot.reach + 0.1  # [m] with what is closed within one step
        self._cargo = make_cargo(params.cargo, robot, params.physics)
        self._bucket = BucketMotion(params.cargo, robot, params.physics)

    def reset(
        self,
        mission: Mission,
        generators: Mapping[str, np.random.Generator],
        legacy: Legacy | None = None,
    ) -> Observation:
        """See :class:`World`; generators are those of people, sensors and cargo.

        Earlier episodes leave no trace but their legacy.
        """
        client, robot, params = self._client, self._robot, self._params
        physics = params.physics
        self._server.empty(self._dt, physics.solver_iterations, physics.contact_erp)
        start = mission.start
        self._ground = Ground(client, self._elevation, start.x, start.y, robot.reach)
        self._body = add_robot(client, robot)
        self._obstacles = NearObstacles(client, self._index, _OBSTACLE_FRICTION, robot)
        self._pedestrians.reset(generators["pedestrians"], mission.start)
        self._crowd = Crowd(
            client,
            self._pedestrians,
            params.people,
            params.pedestrian_bodies,
            robot,
            physics.rate,
        )
        self._book = ContactBook(params.contacts, self._dt, robot.mass)
        if self._cargo:
            pieces = None
            if legacy is not None:
                pieces = legacy.pieces
            self._cargo.reset(generators["cargo"], mission.start.yaw, pieces)
        put_robot(client, self._body, robot, mission.start, self._ground.level)
        self._steps = 0
        self._constants = self._constants_of(robot, physics.gravity, self._dt)
        self._commands.reset()
        self._work = 0.0  # [J] of the motors
        self._footing = ON_LEVEL_GROUND
        self._read_robot()
        self._bucket.reset(self._orientation, self._velocity, self._spin)
        self._clear_around = self._position[:2]  # [m] where nothing is within reach
        self._clear_squared = 0.0  # [m2]
        self._state = self._base_state(BodyState())._replace(ax=0.0, ay=0.0)
        self._truth = self._make_truth()
        self._sensors.reset(self._state, generators)
        if legacy:
            self._sensors.take_over(legacy.errors, legacy.age)
        return self._sensors.measure(self._state, self._crowd.states, 0.0)

    def step(self, command: Twist2D) -> Observation:
        """See :class:`World`.

        The command is limited to the robot's maximum speeds and arrives after its latency.
        """
        robot = self._robot
        speed = min(max(command.linear_x, -robot.max_speed), robot.max_speed)
        yaw_rate = min(max(command.angular_z, -robot.max_yaw_rate), robot.max_yaw_rate)
        self._commands.send(speed, yaw_rate, self._steps)
        self._pedestrians.see_robot(self._state)
        in_company = self._crowd.follow(self._position[0], self._position[1])
        for _ in range(self._steps_per_tick):
            self._advance(*self._commands.receive(self._steps), in_company)
        if not in_company:
            self._pedestrians.steps(self._dt, self._steps_per_tick)
        self._state = self._base_state(self._state)
        self._truth = self._make_truth()
        return self._sensors.measure(self._state, self._truth.pedestrians, self.stamp)

    @property
    def person_radius(self) -> float:
        """See :class:`World`."""
        return self._params.people.radius

    @property
    def truth(self) -> Truth:
        """See :class:`World`."""
        return self._truth

    @property
    def people(self) -> PedestrianModel:
        """Who walks about."""
        return self._pedestrians

    @property
    def tick(self) -> tuple[int, float]:
        """Physics steps of a tick, and the duration of each in [s]."""
        return self._steps_per_tick, self._dt

    @property
    def stamp(self) -> float:
        """Simulated time in [s] since the reset."""
        return self._steps / self._params.physics.rate

    @property
    def body_state(self) -> BodyState:
        """How the robot's base frame truly moves.

        The acceleration is the mean over the last tick.
        """
        return self._state

    @property
    def legacy(self) -> Legacy:
        """What the robot's next episode takes over."""
        pieces = None
        if self._cargo is not None:
            pieces = self._cargo.pieces_on_robot
        return Legacy(self._sensors.lasting(self.stamp), pieces)

    def close_episode(self) -> Truth:
        """Finish the open contact events; returns the final truth."""
        self._book.close_all()
        self._truth = self._make_truth()
        return self._truth

    def close(self) -> None:
        """Free the physics servers; the world cannot be used afterwards."""
        self._server.close()
        if self._cargo:
            self._cargo.close()

    def _advance(self, speed: float, yaw_rate: float, in_company: bool) -> None:
        """One physics step; alone, the robot needs nobody moved before the tick's end."""
        x, y, _ = self._position
        at_step = near = False
        dx, dy = x - self._clear_around[0], y - self._clear_around[1]
        if dx * dx + dy * dy >= self._clear_squared:
            at_step, near = self._look_around(x, y)
        if in_company:
            near = self._crowd.before_step(self._body, x, y, self._steps) or near
        self._apply_forces(speed, yaw_rate)
        before = Motion(self._position, self._velocity, self._spin) if near else None
        bullet.stepSimulation(self._client)
        self._steps += 1
        self._read_robot()
        if near or at_step or self._is_tilted:
            self._read_contacts(before, at_step)
        else:
            self._footing = ON_LEVEL_GROUND
        if self._book.is_waiting:
            self._book.close_old(self.stamp)
        if in_company:
            self._crowd.after_step(self._dt)
        if self._cargo and (
            self._bucket.is_shaken(self._orientation, self._velocity, self._spin)
            or self._cargo.is_awake
        ):
            self._cargo.step(self._bucket.step_of(self._orientation, self._spin))

    def _look_around(self, x: float, y: float) -> tuple[bool, bool]:
        """Whether a step and whether an obstacle can be within reach of a robot at (x, y)."""
        to_step = self._ground.follow(x, y, self._reach) if self._has_steps else math.inf
        to_obstacle = self._obstacles.follow(x, y, self._reach)
        self._clear_around = x, y
        self._clear_squared = max(min(to_step, to_obstacle) - _SLACK, 0.0) ** 2
        near = to_obstacle < 0.0
        if near and not self._is_tilted and not self._book.is_waiting:
            _, _, qz, qw = self._orientation
            near = self._obstacles.can_touch(x, y, 2.0 * math.atan2(qz, qw))
        return to_step < 0.0, near

    def _apply_forces(self, speed: float, yaw_rate: float) -> None:
        """Let drive, weight and scraping act during the coming step."""
        client, body, position, footing = self._client, self._body, self._position, self._footing
        motion = self._orientation, self._velocity, self._spin
        force, torque, power = self._forces(
            *motion,
            footing.left_load,
            footing.right_load,
            speed,
            yaw_rate,
            self._constants,
        )
        self._work += power * self._dt
        # faster than by keywords
        bullet.applyExternalForce(body, -1, force, position, _MAP_FRAME, client)
        bullet.applyExternalTorque(body, -1, torque, _MAP_FRAME, client)
        if footing.scrapes:
            body_motion = Motion(position, self._velocity, self._spin)
            stopping = self._robot.mass / self._dt
            for place, force in footing.friction(body_motion, self._robot.body_friction, stopping):
                bullet.applyExternalForce(body, -1, force, place, _MAP_FRAME, client)

    def _read_robot(self) -> None:
        body, client = self._body, self._client
        self._position, self._orientation = bullet.getBasePositionAndOrientation(body, client)
        self._velocity, self._spin = bullet.getBaseVelocity(body, client)
        (qx, qy, _, _), (wx, wy, _) = self._orientation, self._spin
        self._is_tilted = (
            qx * qx + qy * qy > _LEVEL_SINE_SQUARED or wx * wx + wy * wy > _LEVEL_SPIN_SQUARED
        )

    def _read_contacts(self, before: Motion | None, at_step: bool) -> None:
        """Note what the robot touched in the last step, and what it stands on.

        Args:
            before: the robot's motion before the step; None: there is nothing near to touch.
            at_step: whether it may stand over a step of the ground.
        """
        contacts = bullet.getContactPoints(bodyA=self._body, physicsClientId=self._client)
        ground = self._ground.bodies
        if before:
            touchable = self._obstacles.touchable | self._crowd.touchable
            bodies = [contact for contact in contacts if contact[2] not in ground]
            points = contact_points(
                bodies, self._dt, touchable, self._crowd.motions, self._crowd.gaps
            )
            most = self._params.pedestrian_bodies.max_contact_impulse
            if points and most:
                points = self._limit(points, most)
            self._book.record(self.stamp, points, before)
        self._footing = self._feet.level_footing(is_touched=self._book.is_waiting)
        if at_step or self._is_tilted:
            below = [contact for contact in contacts if contact[2] in ground]
            measured = self._feet.footing(below, self._position, self._orientation)
            if self._is_tilted or not measured.is_whole:
                self._footing = measured

    def _limit(self, points: list[ContactPoint], most: float) -> list[ContactPoint]:
        """Take back what points with people gave the robot beyond ``most`` [N s] each."""
        motion = Motion(self._position, self._velocity, self._spin)
        points, change, turn = limited(points, most, motion, self._orientation, self._robot)
        if any(change) or any(turn):
            shove(self._client, self._body, change, turn, self._dt)
            self._read_robot()
        return points

    def _base_state(self, before: BodyState) -> BodyState:
        """The state now; its acceleration is the mean since ``before``, a tick ago."""
        motion = self._position, self._orientation, self._velocity, self._spin, self._base_offset
        tick = self._steps_per_tick * self._dt
        return BodyState._make(base_state(*motion, before.yaw, before.vx, before.vy, tick))

    def _make_truth(self) -> Truth:
        state = self._state
        return Truth(
            stamp=self.stamp,
            pose=Pose2D(state.x, state.y, state.yaw),
            tilt=state.tilt,
            twist=Twist2D(state.vx, state.vy, state.yaw_rate),
            pedestrians=self._crowd.states,
            counted_contacts=self._book.counted,
            contacts=self._book.finished,
            cargo=self._cargo.state if self._cargo else None,
            motion_energy=self._work,
        )
