"""The limit of a contact point's impulse, against the mechanics of a rigid body."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.world.physics.contacts import ContactPoint, Motion, Touched
from harness.world.physics.engine import Server, bullet
from harness.world.physics.impulse_limit import limited, shove
from harness.world.truth import Partner

MOST = 10.0  # [N s]
CENTRE = (1.0, 2.0, 0.3)  # [m]
STILL = Motion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
LEAN = Rotation.from_euler("zyx", (0.7, 0.2, -0.1))


def point(partner, impulse, position=(1.2, 2.3, 0.9), normal=(-0.6, 0.8, 0.0)):
    return ContactPoint(Touched(partner, "any", 0), position, normal, impulse, STILL)


def limit(points, robot):
    return limited(points, MOST, Motion(CENTRE, (1.0, 0.0, 0.0)), tuple(LEAN.as_quat()), robot)


@pytest.mark.parametrize(
    ("partner", "impulse"),
    [(Partner.PEDESTRIAN, 9.9), (Partner.PEDESTRIAN, MOST), (Partner.PROPERTY, 50.0)],
)
def test_weak_contacts_and_those_with_things_stay_as_they_are(robot, partner, impulse):
    given = [point(partner, impulse)]
    kept, change, spin = limit(given, robot)
    assert kept == given
    assert not change.any() and not spin.any()


def test_what_is_cut_off_is_taken_from_the_robots_momentum_and_spin():
    robot = SimpleNamespace(mass=40.0, inertia=(2.0, 3.0, 5.0))
    given = [
        point(Partner.PEDESTRIAN, 25.0),
        point(Partner.PROPERTY, 99.0),
        point(Partner.PEDESTRIAN, 14.0, (0.7, 1.9, 0.1), (0.0, 0.0, 1.0)),
    ]
    kept, change, spin = limit(given, robot)
    assert [each.impulse for each in kept] == [MOST, 99.0, MOST]
    assert [dataclasses.replace(each, impulse=0.0) for each in kept] == [
        dataclasses.replace(each, impulse=0.0) for each in given
    ]
    first, second = -15.0 * np.array((-0.6, 0.8, 0.0)), -4.0 * np.array((0.0, 0.0, 1.0))
    assert change == pytest.approx((first + second) / 40.0)
    moment = np.cross((0.2, 0.3, 0.6), first) + np.cross((-0.3, -0.1, -0.2), second)
    inertia = LEAN.as_matrix() @ np.diag((2.0, 3.0, 5.0)) @ LEAN.as_matrix().T  # in the map frame
    assert spin == pytest.approx(np.linalg.solve(inertia, moment))


@pytest.mark.parametrize("turn", [(3.0, -2.0, 5.0), (0.0, 0.0, 0.0)])
def test_a_shove_acts_as_if_from_the_steps_beginning(turn):
    """Way and turn of a step of 0.02 s with the changes of velocity and spin are made up for."""
    server = Server()
    shape = bullet.createCollisionShape(
        bullet.GEOM_SPHERE, radius=0.5, physicsClientId=server.client
    )
    body = bullet.createMultiBody(
        2.0, shape, useMaximalCoordinates=1, physicsClientId=server.client
    )
    bullet.resetBasePositionAndOrientation(body, CENTRE, LEAN.as_quat().tolist(), server.client)
    bullet.resetBaseVelocity(body, (0.5, 0.0, -1.0), (0.0, 0.25, 1.0), server.client)
    shove(server.client, body, np.array((1.0, -2.0, 4.0)), np.array(turn), 0.02)
    position, orientation = bullet.getBasePositionAndOrientation(body, server.client)
    velocity, spin = bullet.getBaseVelocity(body, server.client)
    server.close()
    assert position == pytest.approx((1.02, 1.96, 0.38))
    turned = Rotation.from_rotvec(0.02 * np.array(turn)) * LEAN
    assert Rotation.from_quat(orientation).as_matrix() == pytest.approx(
        turned.as_matrix(), abs=1e-6
    )
    assert velocity == pytest.approx((1.5, -2.0, 3.0))
    assert spin == pytest.approx((turn[0], turn[1] + 0.25, turn[2] + 1.0))
