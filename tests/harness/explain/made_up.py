"""A made-up delivery: along x at 1 m/s, and a person who is met at 8 s."""

import dataclasses

import numpy as np

from harness.explain.evidence import RECORDING, Evidence
from harness.explain.moments import Moment
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.metrics.decisions import CRITIC_COLUMNS, DECISION_COLUMNS
from harness.metrics.encounters import Body
from harness.world.outcome import Rules

END, HIT = 20.0, 8.0  # [s]
OFF = (0.3, 0.4)  # [m] of the belief: 0.5 m
RULES = Rules(2.0, 241.0, 0.5, 177.78, 0.05)
BODY = Body((0.0, 0.0), (0.5, 0.3), 0.25)
FOOTPRINT = np.array([[0.5, 0.3], [0.5, -0.3], [-0.5, -0.3], [-0.5, 0.3]])
STAMPS = np.arange(0.1, END + 0.05, 0.1)
CRITICS = {"PathDist": (2.0, 1.0, 0), "BaseObstacle": (10.0, 0.2, 7)}  # raw, weighted, rejected


def decision(stamp, **more):
    """A cycle in which DWB kept to 1 m/s."""
    row = {**dict.fromkeys(DECISION_COLUMNS), "stamp_s": stamp, "decided_by": "DWBLocalPlanner"}
    row |= {
        "wanted_linear_x_mps": 1.0,
        "wanted_angular_z_radps": 0.0,
        "monitor_action": "none",
        "health": "tracking",
    }
    row |= {"command_linear_x_mps": 1.0, "command_angular_z_radps": 0.0, "status": ""}
    row |= {"believed_x_m": stamp + OFF[0], "believed_y_m": OFF[1], "believed_yaw_rad": 0.0}
    row |= {"samples": 100, "rejected": 7, "total_score": 1.2}
    for name, values in CRITICS.items():
        row |= {f"{name}_{end}": value for end, value in zip(CRITIC_COLUMNS, values, strict=True)}
    return row | more


def contact(stamp, cost, person=1):
    row = {**dict.fromkeys(EVENT_COLUMNS), "stack": "mine", "episode": 0, "type": "counted_contact"}
    row |= {
        "stamp_s": stamp,
        "cost_usd": cost,
        "partner": "pedestrian",
        "kind": "pedestrian",
        "partner_id": person,
    }
    speeds = {"robot_speed_mps": 1.0, "partner_speed_mps": 0.5}
    return (
        row
        | speeds
        | {"impulse_ns": 80.0, "x_m": stamp + 0.5, "y_m": 0.0, "fault": "robot_into_person"}
    )


def arrays():
    """Along x at 1 m/s; person 1 comes at 0.5 m/s and is met at 8 s, person 0 stands 30 m aside.

    A tracker sees him
    from 5 s on, where the robot believes him to be."""
    rows = len(STAMPS)
    x = STAMPS
    met = HIT + BODY.half_size[0] + BODY.person_radius - 0.5 * (STAMPS - HIT)
    crowd = np.zeros((rows, 2, 2))
    crowd[:, 0] = (0.0, 30.0)
    crowd[:, 1, 0] = met
    zero = np.zeros(rows)
    trace = np.column_stack(
        (STAMPS, x, zero, zero, zero + 1.0, zero, x + OFF[0], zero + OFF[1], zero, zero + 1.0, zero)
    )
    seen = STAMPS > 5.05
    tracks = np.zeros((int(seen.sum()), 6))
    tracks[:, 1], tracks[:, 2] = met[seen] + OFF[0], OFF[1]
    return {
        "trace": trace,
        "crowd": crowd,
        "pieces_lost": (STAMPS > 12.05).astype(np.int32) * 3,
        "track_count": seen.astype(np.int32),
        "tracks": tracks.astype(np.float32),
        "plan_stamp": np.array([0.0]),
        "plan_size": np.array([2], dtype=np.int32),
        "plan_xy": np.array([[0.0, 0.0], [30.0, 0.0]], dtype=np.float32),
        "motion_energy_j": zero,
        "odometry": np.zeros((rows, 5)),
        "belief_covariance": np.zeros((rows, 3), dtype=np.float32),
        "scan_stamp": STAMPS,
        "scan_mm": np.zeros((rows, 4), dtype=np.uint16),
        "scan_geometry": np.zeros(7),
    }


def evidence(**more):
    given = arrays()
    row = {
        **dict.fromkeys(EPISODE_COLUMNS, 0.0),
        "stack": "mine",
        "map": "sidewalk",
        "seed": 0,
        "episode": 0,
    }
    row |= {
        "outcome": "sla",
        "reason": "arrived",
        "duration_s": END,
        "pieces_at_start": 50,
        "pieces_lost": 3,
    }
    row |= {"goal_x_m": 40.0, "goal_y_m": 0.0, "distance_m": END, "average_speed_mps": 1.0}
    made = Evidence(
        row=row | more.pop("row", {}),
        events=(contact(HIT, 20.0),),
        trace=given["trace"],
        crowd=given["crowd"],
        pieces_lost=given["pieces_lost"].astype(float),
        tracks=tuple(np.split(given["tracks"].astype(float), np.cumsum(given["track_count"])[:-1])),
        plans=((0.0, given["plan_xy"]),),
        decisions=tuple(decision(stamp) for stamp in np.arange(0.0, END, 0.05)),
        weighed=None,
        body=BODY,
        footprint=FOOTPRINT,
        source=RECORDING,
    )
    return dataclasses.replace(made, **more)


def moment_at(stamp=HIT, kind="contact"):
    return Moment(1, kind, stamp, 20.0, contact(stamp, 20.0) if kind == "contact" else None)
