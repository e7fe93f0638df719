"""Bodies for the people near the robot."""

import math
from collections.abc import Mapping

import numpy as np

from harness.world.people.body_frames import LEAP, BodyFrames
from harness.world.people.body_params import PedestrianBodyParams
from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import PedestrianModel
from harness.world.people.person_bodies import add_person, person_shape, put_person
from harness.world.people.walk_kernels import count_near
from harness.world.physics.contacts import Motion, Touched, Vector
from harness.world.physics.engine import bullet
from harness.world.physics.robot import RobotParams
from harness.world.truth import Partner
from navstack.types import FloatArray

_UNSTOPPABLE = 1e6  # [kg] of a kinematic body: the robot cannot slow it down
_CATCH_UP_TIME = 0.5  # [s] in which a dynamic body makes up for being pushed off its way
_SETTLED = 0.05  # [m] off its way, below which a dynamic body may be given up


class Crowd:
    """Moves people by their model and gives those near the robot a body.

    Kinematic bodies follow the model whatever they hit. Dynamic ones move by a limited force and
    can be pushed. A model that takes pushes goes on from where its bodies are, step by step, and
    says where they are to be after the next one; bodies of another model steer back to the way that
    it knows. Kinematic ones may move once per rendered frame (:class:`BodyFrames`). A real person
    would also stumble and fall; these stay upright.
    """

    ACTIVE_RADIUS = 3.0  # [m] around the robot's body centre, if it is not long
    BEYOND_REACH = 2.0  # [m] around any robot

    def __init__(
        self,
        client: int,
        model: PedestrianModel,
        people: PedestrianParams,
        bodies: PedestrianBodyParams,
        robot: RobotParams,
        rate: float,
    ) -> None:
        """Begin without bodies.

        Args:
            client: of the physics server.
            model: how people walk.
            people: their size and speed.
            bodies: how their bodies behave.
            robot: whom they may touch.
            rate: [Hz] of the physics.
        """
        self._client = client
        self._model = model
        self._is_dynamic = bodies.kind == "dynamic"
        self._is_led = self._is_dynamic and model.takes_pushes  # the model goes on from the bodies
        self._mass = _UNSTOPPABLE
        if self._is_dynamic:
            self._mass = bodies.mass
        self._gain = self._mass * rate  # [N s/m] reaches the wanted velocity in one step
        self._is_recorded = people.model == "replay"  # who may be faster than people of the world
        self._top_speed = 2.0 * people.speed  # [m/s] of a body that makes up for a push
        self._push_force = bodies.push_force  # [N]
        self._shape = person_shape(client, people.radius, people.height, robot.height)
        self._friction = friction_factor(bodies, robot.body_friction)
        self._radius = max(self.ACTIVE_RADIUS, robot.reach + self.BEYOND_REACH)
        # [m] with what is closed within one step
        self._reach = robot.reach + people.radius + 0.1
        self._frames: BodyFrames | None = None
        if bodies.frame_steps > 1:
            self._frames = BodyFrames(client, bodies, rate)
            self._reach += LEAP
        self._bodies: dict[int, int] = {}  # person -> body
        self.touchable: dict[int, Touched] = {}  # body -> who it is
        self.motions: dict[int, Motion] = {}  # body -> motion before the step

    @property
    def gaps(self) -> Mapping[int, float]:
        """Distance [m] from the robot of the bodies that were put in touch with it."""
        return self._frames.gaps if self._frames else {}

    @property
    def states(self) -> FloatArray:
        """Everybody now, (n, 4): x, y [m], vx, vy [m/s], map frame."""
        if not (self._is_dynamic and self._bodies):
            return self._model.states
        states = self._model.states.copy()
        for person, body in self._bodies.items():
            (x, y, _), (vx, vy, _) = self._body_state(body)
            states[person] = (x, y, vx, vy)
        return states

    def follow(self, x: float, y: float) -> bool:
        """Choose who has a body, for a robot whose body centre is at (x, y).

        Returns:
            Whether anybody has one.
        """
        states = self._model.states
        if not self._bodies and not count_near(states, x, y, self._radius):
            return False
        dx, dy = states[:, 0] - x, states[:, 1] - y
        wanted = np.flatnonzero(dx * dx + dy * dy < self._radius**2).tolist()
        for person in list(self._bodies):
            if person not in wanted and self._may_go(person):
                self._remove(person)
        for person in wanted:
            if person not in self._bodies:
                self._add(person)
        return bool(self._bodies)

    def _add(self, person: int) -> None:
        body = add_person(self._client, self._shape, self._mass, self._friction)
        x, y, vx, vy = self._model.states[person].tolist()
        put_person(self._client, body, (x, y, 0.0), (vx, vy, 0.0))
        if self._frames:
            self._frames.add(body, x, y)
        self._bodies[person] = body
        self.touchable[body] = Touched(Partner.PEDESTRIAN, "pedestrian", person)

    def _remove(self, person: int) -> None:
        body = self._bodies.pop(person)
        del self.touchable[body]
        self.motions.pop(body, None)
        if self._frames:
            self._frames.remove(body)
        bullet.removeBody(body, physicsClientId=self._client)

    def _may_go(self, person: int) -> bool:
        if not self._is_dynamic or self._is_led:
            return True
        (x, y, _), _ = self._body_state(self._bodies[person])
        wanted = self._model.states[person]
        return math.hypot(x - wanted[0], y - wanted[1]) < _SETTLED

    def before_step(self, robot: int, x: float, y: float, step: int) -> bool:
        """Place or push the bodies for the coming physics step.

        Args:
            robot: its body.
            x: [m] of its centre.
            y: [m].
            step: number of the physics step in the episode.

        Returns:
            Whether the robot can touch somebody.
        """
        if not self._bodies:
            return False
        states = self._model.states
        reach = self._reach
        near = False
        for person, body in self._bodies.items():
            px, py, vx, vy = states[person].tolist()
            if self._is_dynamic:
                px, py, vx, vy = self._steer(body, px, py, vx, vy)
            elif self._frames:
                px, py = self._frames.show(body, px, py, step)
            else:
                put_person(self._client, body, (px, py, 0.0), (vx, vy, 0.0))
            self.motions[body] = Motion((px, py, 0.0), (vx, vy, 0.0))
            if math.hypot(px - x, py - y) < reach:
                near = True
                if self._frames:
                    self._frames.meet(body, robot)
        return near

    def after_step(self, dt: float) -> None:
        """Move everybody by the ``dt`` [s] of a physics step that is over."""
        if self._is_led:
            for person, body in self._bodies.items():
                (x, y, _), (vx, vy, _) = self._body_state(body)
                self._model.displaced(person, x, y, vx, vy)
        self._model.step(dt)
        for person in list(self._bodies):
            if self._model.states[person, 0] == math.inf:
                self._remove(person)

    def _steer(
        self,
        body: int,
        x: float,
        y: float,
        vx: float,
        vy: float,
    ) -> tuple[float, float, float, float]:
        """Push a dynamic body towards where its model is; returns its state before the step."""
        (bx, by, bz), (ux, uy, uz) = self._body_state(body)
        gain = self._gain
        if not self._is_led:
            gain *= 0.1  # in about ten steps
            most = self._top_speed
            if self._is_recorded:
                most = max(most, 2.0 * math.hypot(vx, vy))
            vx, vy = vx + (x - bx) / _CATCH_UP_TIME, vy + (y - by) / _CATCH_UP_TIME
            vx, vy = _at_most(most, vx, vy)
        fx, fy = _at_most(self._push_force, gain * (vx - ux), gain * (vy - uy))
        fz = gain * (-bz / _CATCH_UP_TIME - uz)  # stays on the ground
        bullet.applyExternalForce(
            body,
            -1,
            (fx, fy, fz),
            (bx, by, bz),
            bullet.WORLD_FRAME,
            self._client,
        )
        return bx, by, ux, uy

    def _body_state(self, body: int) -> tuple[Vector, Vector]:
        position, _ = bullet.getBasePositionAndOrientation(body, self._client)
        velocity, _ = bullet.getBaseVelocity(body, self._client)
        return position, velocity


def _at_most(length: float, x: float, y: float) -> tuple[float, float]:
    """The vector (x, y), shortened to a length."""
    norm = math.hypot(x, y)
    if norm <= length:
        return x, y
    return x * (length / norm), y * (length / norm)


def friction_factor(people: PedestrianBodyParams, robot: float) -> float:
    """A person's friction [-] for Bullet, which multiplies the coefficients of two bodies.

    PhysX averages them.

    Args:
        people: who is touched.
        robot: [-] the robot's own. For 0 no factor makes an average: such a robot stays without
            friction.
    """
    if people.friction_combine == "multiply" or robot == 0.0:
        return people.friction
    return 0.5 * (people.friction + robot) / robot
