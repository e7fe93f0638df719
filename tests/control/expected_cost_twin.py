"""A slow twin of the motions' prices, written from docs/expected_cost.md in plain numpy."""

import math

import numpy as np
from scipy.ndimage import map_coordinates


def at(field, values, x, y):
    """Bilinear interpolation between cells' middles, held at the edge."""
    u, v = (x - field.origin_x) / field.cell - 0.5, (y - field.origin_y) / field.cell - 0.5
    return float(map_coordinates(values, [[v], [u]], order=1, mode="nearest")[0])


def roll_out(motion, scene):
    """States (N, 5) of a motion and what its accelerations shake."""
    kind, v1, b1, t1, kind2, v2, b2, t2, v3 = motion
    x, y, yaw, v, w = scene.start
    limits, dt, states, shaken = scene.limits, scene.step, [], 0.0
    for k in range(len(scene.care)):
        t = k * dt
        part = (kind, v1, b1) if t < t1 else (kind2, v2, b2) if t < t1 + t2 else (0.0, v3, 0.0)
        speed, turn = part[1], part[2]
        if part[0] == 0.0:
            way = math.atan2(at(scene.field, scene.field.slope_y, x, y), at(scene.field, scene.field.slope_x, x, y))
            off = math.remainder(way + turn - yaw, 2.0 * math.pi)
            speed, turn = speed * max(0.0, math.cos(off)) ** 3, limits.turn_gain * off
        turn = np.clip(turn, -limits.max_yaw_rate, limits.max_yaw_rate)
        if abs(speed * turn) > limits.max_lateral_acceleration:
            speed = math.copysign(limits.max_lateral_acceleration / abs(turn), speed)
        speed = np.clip(speed, -limits.max_reverse_speed, limits.max_speed)
        speeds_up = (speed - v) * v >= 0.0
        most = (limits.max_acceleration if speeds_up else limits.max_deceleration) * dt
        dv = np.clip(speed - v, -most, most)
        dw = np.clip(turn - w, -limits.max_yaw_acceleration * dt, limits.max_yaw_acceleration * dt)
        if abs(v * (w + dw)) > 1.3 * limits.max_lateral_acceleration and abs(w + dw) > abs(w):
            dw = 0.0
        middle = yaw + 0.5 * (w + 0.5 * dw) * dt
        x += (v + 0.5 * dv) * math.cos(middle) * dt
        y += (v + 0.5 * dv) * math.sin(middle) * dt
        yaw += (w + 0.5 * dw) * dt
        v, w = v + dv, w + dw
        shaken += (dv / dt) ** 2 * dt + (v * w) ** 2 * dt
        states.append((x, y, yaw, v, w))
    return np.array(states), shaken


def chance(z):
    return 1.0 / (1.0 + math.exp(1.702 * z))


def clearance(scene, x, y, yaw):
    """Of the circles that cover the robot, from the map's grid or the scans'."""
    least = math.inf
    for along in scene.circles:
        px, py = x + along * math.cos(yaw), y + along * math.sin(yaw)
        for metres, (ox, oy, cell) in (
            (scene.clearance.mapped, scene.clearance.mapped_grid),
            (scene.clearance.seen, scene.clearance.seen_grid),
        ):
            row, column = int((py - oy) / cell), int((px - ox) / cell)
            is_on = 0 <= row < metres.shape[0] and 0 <= column < metres.shape[1]
            least = min(least, metres[row, column] if is_on else 3.0)
    return least - scene.circle_radius


def touch(scene, state, person, std, radius, room):
    """Price [USD] of touching a person and of the squeeze, each times its chance, and how deep [m]."""
    x, y, yaw, v, w = state
    body, rates, prices = scene.body, scene.rates, scene.touch
    turn = np.array(((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))))
    place, velocity = turn @ (person[:2] - (x, y)), turn @ person[2:]
    low = np.array((body.centre - body.half_length, -body.half_width))
    high = np.array((body.centre + body.half_length, body.half_width))
    nearest = np.clip(place, low, high)
    gap = float(np.hypot(*(place - nearest)))
    if gap > 1e-6:
        normal = (place - nearest) / gap
    else:
        out = np.concatenate((place - high, low - place))
        side = int(np.argmax(out))
        normal = np.array(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[side])
        gap = out[side]
    gap -= radius
    closing = float((np.array((v - w * nearest[1], w * nearest[0])) - velocity) @ normal)
    injury = np.interp(max(closing, prices.counted_speed), np.arange(len(scene.contact_usd)), scene.contact_usd)
    price = prices.touch_usd + chance((prices.counted_speed - closing) / prices.speed_std) * injury
    squeeze = rates.squeeze_usd * max(0.0, 1.0 - max(room, 0.0) / rates.squeeze_width)
    far = gap > 4.0 * std or np.hypot(*(place - (body.centre, 0.0))) > 3.0
    likely = 0.0 if far else chance(gap / std)
    return likely * price, likely * squeeze, 0.0 if far else max(0.0, -gap)


def terms(motion, scene, goal_radius):
    """The six terms [USD] of a motion."""
    states, shaken = roll_out(motion, scene)
    rates, people = scene.rates, scene.people
    wall = inside = contact = squeeze = 0.0
    rooms = [clearance(scene, *state[:3]) for state in states]
    for care, room in zip(scene.care, rooms, strict=True):
        if room < 4.0 * rates.wall_std:
            wall = max(wall, care * rates.wall_usd * chance(room / rates.wall_std))
            inside += care * rates.inside_usd * max(0.0, -room) * scene.step
    for h, weight in enumerate(people.weight):
        worst = (0.0, 0.0)
        for k, state in enumerate(states):
            price, wall_part, depth = touch(
                scene, state, people.motion[h, k], people.std[h, k], people.radius[h], rooms[k]
            )
            factor = scene.care[k] * weight
            if factor * (price + wall_part) > sum(worst):
                worst = (factor * price, factor * wall_part)
            inside += factor * rates.inside_usd * depth * scene.step
        contact, squeeze = contact + worst[0], squeeze + worst[1]
    delay = rates.second_usd * seconds_left(states, scene, goal_radius)
    return np.array((contact, squeeze, wall, inside, rates.shake_usd * shaken, delay))


def seconds_left(states, scene, goal_radius):
    x, y, yaw, v, _ = states[-1]
    field, speed = scene.field, scene.limits.max_speed
    left = at(field, field.cost, x, y)
    off = abs(
        math.remainder(math.atan2(at(field, field.slope_y, x, y), at(field, field.slope_x, x, y)) - yaw, 2.0 * math.pi)
    )
    seconds = left / speed + min(1.0, left / 3.0) * (0.5 * off - 0.3 * v)
    there = [at(field, field.cost, *state[:2]) for state in states]
    arrived = [k for k, cost in enumerate(there) if cost <= goal_radius]
    if arrived and left <= 3.0 + speed * scene.step * len(states):
        k = arrived[0]
        seconds = min(seconds, (there[k] + 0.1 * left) / speed - (len(states) - 1 - k) * scene.step)
    return seconds
