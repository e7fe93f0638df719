"""The prices of the expected-cost controller's motions in plain numpy, and scenes to price."""

import math

import numpy as np

from navstack.control.contact_risk import ContactRates, body_of, nearest
from navstack.control.expected_cost.clearance import map_clearance, with_obstacles
from navstack.control.expected_cost.field import make_field, ways_of
from navstack.control.expected_cost.motion_cost import MotionScene, Rates
from navstack.control.expected_cost.people import Spread, predict
from navstack.control.expected_cost.rollout import MotionLimits
from navstack.costmap.costmap import Costmap
from navstack.geometry import cover
from navstack.params.expected_cost import ExpectedCostParams
from navstack.planning.cost_to_go import cost_to_go
from navstack.types import FloatArray, Pose2D, Track

from ..given import box

PARAMS = ExpectedCostParams()
FOOTPRINT = box(0.14, -0.607, 0.25)  # [m]
GOAL = Pose2D(15.0, 28.0, 0.5 * math.pi)
GOAL_RADIUS = 0.5  # [m]
_FAR = 3.0  # [m] beyond what the scans show, and beyond which nobody is touched
_OFF_MAP = -1.0  # [m]
_CERTAIN = 4.0  # standard deviations beyond which nothing happens


def terms(motions, scene):
    """The six terms (M, 6) [USD] of motions (M, FIELDS)."""
    states, shaken = roll_out(motions, scene)
    rates = scene.rates
    people = scene.people
    care = scene.care
    room = clearance(states, scene)
    near = room < _CERTAIN * rates.wall_std
    wall = np.where(near, care * rates.wall_usd * chance(room / rates.wall_std), 0.0).max(axis=1)
    inside = (
        np.where(near, care * rates.inside_usd * np.maximum(0.0, -room), 0.0) * scene.step
    ).sum(axis=1)
    contact = np.zeros(len(motions))
    squeeze = np.zeros(len(motions))
    for h, weight in enumerate(people.weight):
        price, pressed, depth = touch(
            states,
            people.motion[h],
            people.std[h],
            people.radius[h],
            room,
            scene,
        )
        price = care * weight * price
        pressed = care * weight * pressed
        worst = (price + pressed).argmax(axis=1)[:, None]
        contact += np.take_along_axis(price, worst, axis=1)[:, 0]
        squeeze += np.take_along_axis(pressed, worst, axis=1)[:, 0]
        inside += (care * weight * rates.inside_usd * depth * scene.step).sum(axis=1)
    delay = rates.second_usd * seconds_left(states, scene)
    return np.column_stack((contact, squeeze, wall, inside, rates.shake_usd * shaken, delay))


def roll_out(motions, scene):
    """States (M, N, 5) of motions (M, FIELDS), and what their accelerations shake (M,) [m2/s3]."""
    kind, v1, b1, t1, kind2, v2, b2, t2, v3 = motions.T
    x, y, yaw, v, w = (np.full(len(motions), each) for each in scene.start)
    limits = scene.limits
    dt = scene.step
    shaken = np.zeros(len(motions))
    states = np.empty((len(motions), len(scene.care), 5))
    for k in range(len(scene.care)):
        part = [k * dt < t1, k * dt < t1 + t2]
        follows = np.select(part, (kind, kind2), 0.0) == 0.0
        speed = np.select(part, (v1, v2), v3)
        turn = np.select(part, (b1, b2), 0.0)
        off = angle_off(scene.field, x, y, yaw - turn)
        speed = np.where(follows, speed * np.maximum(0.0, np.cos(off)) ** 3, speed)
        turn = np.where(follows, limits.turn_gain * off, turn).clip(
            -limits.max_yaw_rate, limits.max_yaw_rate
        )
        with np.errstate(divide="ignore"):
            fastest = limits.max_lateral_acceleration / np.abs(turn)
        speed = speed.clip(-fastest, fastest).clip(-limits.max_reverse_speed, limits.max_speed)
        most = (
            np.where((speed - v) * v >= 0.0, limits.max_acceleration, limits.max_deceleration) * dt
        )
        dv = (speed - v).clip(-most, most)
        dw = (turn - w).clip(-limits.max_yaw_acceleration * dt, limits.max_yaw_acceleration * dt)
        tips = np.abs(v * (w + dw)) > 1.3 * limits.max_lateral_acceleration
        dw = np.where(tips & (np.abs(w + dw) > np.abs(w)), 0.0, dw)
        middle = yaw + 0.5 * (w + 0.5 * dw) * dt
        x = x + (v + 0.5 * dv) * np.cos(middle) * dt
        y = y + (v + 0.5 * dv) * np.sin(middle) * dt
        yaw = yaw + (w + 0.5 * dw) * dt
        v = v + dv
        w = w + dw
        shaken += (dv / dt) ** 2 * dt + (v * w) ** 2 * dt
        states[:, k] = np.column_stack((x, y, yaw, v, w))
    return states, shaken


def seconds_left(states, scene):
    """Seconds (M,) from the ends of motions to the goal."""
    field = scene.field
    limits = scene.limits
    steps = states.shape[1]
    there = at(field, field.cost, states[..., 0], states[..., 1])
    left = there[:, -1]
    (x, y, yaw, v, _) = states[:, -1].T
    off = np.abs(angle_off(field, x, y, yaw))
    seconds: FloatArray = left / limits.max_speed + np.minimum(1.0, left / 3.0) * (
        0.5 * off - 0.3 * v
    )
    arrived = there <= limits.goal_radius
    first = arrived.argmax(axis=1)
    early = there[np.arange(len(there)), first] + 0.1 * left
    early = early / limits.max_speed - (steps - 1 - first) * scene.step
    counts = arrived.any(axis=1) & (left <= 3.0 + limits.max_speed * scene.step * steps)
    return np.where(counts, np.minimum(seconds, early), seconds)


def clearance(states, scene):
    """Room (M, N) [m] of the circles that cover the robot, on the map's grid and the scans'."""
    least = np.full(states.shape[:2], np.inf)
    for along in scene.circles:
        px = states[..., 0] + along * np.cos(states[..., 2])
        py = states[..., 1] + along * np.sin(states[..., 2])
        for metres, (ox, oy, cell), off in (
            (scene.clearance.mapped, scene.clearance.mapped_grid, _OFF_MAP),
            (scene.clearance.seen, scene.clearance.seen_grid, _FAR),
        ):
            if not len(metres):
                continue
            row = ((py - oy) / cell).astype(int)
            column = ((px - ox) / cell).astype(int)
            height, width = metres.shape
            on = (py >= oy) & (px >= ox) & (row < height) & (column < width)
            least = np.minimum(
                least, np.where(on, metres[row.clip(0, height - 1), column.clip(0, width - 1)], off)
            )
    return least - scene.circle_radius


def touch(
    states,
    person,
    std,
    radius,
    room,
    scene,
):
    """Of one hypothesis (N, 4): price and squeeze (M, N) [USD], and how deep (M, N) [m].

    Price and squeeze are each times its chance.
    """
    x, y, yaw, v, w = np.moveaxis(states, -1, 0)
    body = scene.body
    rates = scene.rates
    prices = scene.touch
    cos = np.cos(yaw)
    sin = np.sin(yaw)
    dx = person[:, 0] - x
    dy = person[:, 1] - y
    px = cos * dx + sin * dy
    py = cos * dy - sin * dx
    vx = cos * person[:, 2] + sin * person[:, 3]
    vy = cos * person[:, 3] - sin * person[:, 2]
    front = body.centre + body.half_length
    rear = body.centre - body.half_length
    side = body.half_width
    qx = px.clip(rear, front)
    qy = py.clip(-side, side)
    outside = np.hypot(px - qx, py - qy)
    beyond = np.stack((px - front, py - side, rear - px, -side - py))
    which = beyond.argmax(axis=0)
    is_out = outside > 1e-6
    gap = np.where(is_out, outside, beyond.max(axis=0)) - radius
    distance = np.where(is_out, outside, 1.0)
    nx = np.where(is_out, (px - qx) / distance, np.array((1.0, 0.0, -1.0, 0.0))[which])
    ny = np.where(is_out, (py - qy) / distance, np.array((0.0, 1.0, 0.0, -1.0))[which])
    closing = (v - w * qy - vx) * nx + (w * qx - vy) * ny
    speeds = np.arange(len(scene.contact_usd))
    injury = np.interp(np.maximum(closing, prices.counted_speed), speeds, scene.contact_usd)
    price = prices.touch_usd + chance((prices.counted_speed - closing) / prices.speed_std) * injury
    pressed = rates.squeeze_usd * np.maximum(0.0, 1.0 - np.maximum(room, 0.0) / rates.squeeze_width)
    meets = (gap <= _CERTAIN * std) & (np.hypot(px - body.centre, py) <= _FAR)
    along = within(px - body.centre, body.half_length + radius, std)
    across = within(py, side + radius, std)
    likely = np.where(meets, along * across, 0.0)
    return likely * price, likely * pressed, np.where(meets, np.maximum(0.0, -gap), 0.0)


def angle_off(field, x, y, yaw):
    """From ``yaw`` to the field's descent, in [-pi, pi] [rad]."""
    off: FloatArray = (
        np.arctan2(at(field, field.slope_y, x, y), at(field, field.slope_x, x, y)) - yaw
    )
    return off - 2.0 * math.pi * np.round(off / (2.0 * math.pi))


def at(field, values, x, y):
    """Bilinear interpolation between cells' middles.

    Beyond the grid that of the nearest point on it.
    """
    height, width = values.shape
    u = (x - field.origin_x) / field.cell - 0.5
    v = (y - field.origin_y) / field.cell - 0.5
    column = u.astype(int).clip(0, width - 2)
    row = v.astype(int).clip(0, height - 2)
    right = (u - column).clip(0.0, 1.0)
    up = (v - row).clip(0.0, 1.0)
    low = (1.0 - right) * values[row, column] + right * values[row, column + 1]
    high = (1.0 - right) * values[row + 1, column] + right * values[row + 1, column + 1]
    found: FloatArray = (1.0 - up) * low + up * high
    return found


def within(offset, half, std):
    """That a normal variable of this mean is within half of 0."""
    return chance((np.abs(offset) - half) / std) - chance((np.abs(offset) + half) / std)


def chance(z):
    """That a standard normal variable is above z: the logistic function nearest to it."""
    found: FloatArray = 1.0 / (1.0 + np.exp(1.702 * z))
    return found


def street():
    """30 x 30 m, a street of 15 m along y between two walls."""
    data = np.zeros((600, 600), dtype=np.uint8)
    data[:, :150] = data[:, 450:] = 254
    floor = data.copy()
    floor.flags.writeable = False
    return Costmap(data, 0.05, 0.0, 0.0, floor)


def scene_of(rng, count):
    """A random situation among ``count`` people on the street, with something that no map shows."""
    world = street()
    seen = Costmap(np.ascontiguousarray(world.data[60:540, 60:540]), 0.05, 3.0, 3.0)
    seen.data[300:306, 200:210] = 254
    place = Pose2D(15.0 + rng.uniform(-6.5, 6.5), rng.uniform(6.0, 26.0))
    clearance = with_obstacles(
        map_clearance(world), seen, (place.x, place.y), np.zeros((0, 3)), 0.0
    )
    people = nearest(crowd(rng, count, place, 2.0), place, 0.0, count, math.inf)
    spread = Spread(*(getattr(PARAMS, name) for name in Spread._fields))
    return MotionScene(
        np.array(
            (
                place.x,
                place.y,
                rng.uniform(-3.0, 3.0),
                rng.uniform(-1.0, 2.0),
                rng.uniform(-1.0, 1.0),
            )
        ),
        make_field(ways_of(world, 0.2), GOAL, cost_to_go),
        clearance,
        predict(
            people,
            rng.uniform(0.0, 1.0, len(people)),
            place.x,
            place.y,
            PARAMS.steps,
            PARAMS.step,
            spread,
            clearance,
        ),
        body_of(FOOTPRINT),
        *cover(FOOTPRINT, 4),
        MotionLimits(
            goal_radius=GOAL_RADIUS,
            **{name: getattr(PARAMS, name) for name in MotionLimits._fields[:-1]},
        ),
        Rates(*(float(getattr(PARAMS, name)) for name in Rates._fields)),
        ContactRates(*(getattr(PARAMS, name) for name in ContactRates._fields)),
        np.array(PARAMS.contact_usd),
        np.exp(-PARAMS.step * np.arange(1, PARAMS.steps + 1) / PARAMS.caution_time),
        PARAMS.step,
    )


def crowd(rng, count, place, away):
    """People about ``away`` [m] from a place, who walk about 1 m/s in any direction."""
    offsets = rng.normal(0.0, away, (count, 2))
    velocities = rng.normal(0.0, 1.0, (count, 2))
    covariance = np.diag((0.02, 0.02, 0.02, 0.02))
    return tuple(
        Track(k, 0.0, place.x + dx, place.y + dy, vx, vy, 0.3, covariance)
        for k, ((dx, dy), (vx, vy)) in enumerate(
            zip(offsets.tolist(), velocities.tolist(), strict=True)
        )
    )


def prediction(one, world=None, yielding=0.0):
    """The hypotheses of one person in the street, seen from (15, 10) m."""
    clearance = map_clearance(world or street())
    spread = Spread(*(getattr(PARAMS, name) for name in Spread._fields))
    return predict(
        np.array([one]),
        np.array([yielding]),
        15.0,
        10.0,
        PARAMS.steps,
        PARAMS.step,
        spread,
        clearance,
    )
