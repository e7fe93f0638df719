"""Run folders without a simulation: rows drawn at random, priced as a run prices them."""

import numpy as np
import pytest

from harness.economics.contact_costs import injury_costs, injury_measures, property_cost
from harness.economics.prices import load_prices
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS, TIMING_COLUMNS
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder
from harness.storage.shipped import shipped
from navbench.cli.app import main
from navstack.params.strict import dump_dataclass

TABLES = {"episodes": EPISODE_COLUMNS, "events": EVENT_COLUMNS, "timings": TIMING_COLUMNS}
TIMEOUT = 241.0  # [s]


def _contacts(rng, crowd):
    """A few contacts of one delivery, with people and with a mailbox.

    Each as an event, the hard ones also counted.
    """
    rows = []
    for number in range(rng.poisson(crowd)):
        person = rng.random() < 0.8
        robot, partner = (
            (float(speed) for speed in rng.uniform(-0.1, 1.5, 2)) if person else (1.2, 0.0)
        )
        impulse = float(rng.uniform(5.0, 140.0))
        kind = "pedestrian" if person else "mailbox"
        moved = "robot_into_person" if robot >= partner else "person_into_robot"
        fault = (
            "robot_into_property"
            if not person
            else "person_into_standing_robot"
            if abs(robot) < 0.05
            else moved
        )
        event = {
            "type": "contact_event",
            "stamp_s": float(number),
            "partner": "pedestrian" if person else "property",
            "kind": kind,
            "partner_id": number,
            "impulse_ns": impulse,
            "robot_speed_mps": robot,
            "partner_speed_mps": partner,
            "fault": fault,
        }
        rows.append(event)
        if impulse >= 50.0:
            rows.append({**event, "type": "counted_contact"})
    return rows


def _row(stack, number, episode, seed, rng):
    # no straight way is longer than the shortest drive below
    mission = np.random.default_rng((seed, episode)).uniform(0.0, 20.0, 5).tolist()
    measured = {
        name: float(rng.uniform(0.1, 2.0))
        for name, kind in EPISODE_COLUMNS.items()
        if kind == "double"
    }
    counts = {
        name: int(rng.integers(0, 4)) for name, kind in EPISODE_COLUMNS.items() if kind == "int64"
    }
    keys = ("start_x_m", "start_y_m", "start_yaw_rad", "goal_x_m", "goal_y_m")
    duration, distance = float(rng.uniform(30.0, 200.0)), float(rng.uniform(30.0, 150.0))
    outcome = str(
        rng.choice(["sla", "spoiled", "timeout", "physical_assistance"], p=[0.7, 0.1, 0.1, 0.1])
    )
    if outcome == "timeout":
        duration = TIMEOUT
    return {
        **dict.fromkeys(EPISODE_COLUMNS),
        **measured,
        **counts,
        **dict(zip(keys, mission, strict=True)),
        "stack": stack,
        "stack_number": number,
        "map": "sidewalk",
        "seed": seed,
        "episode": episode,
        "duration_s": duration,
        "distance_m": distance,
        "average_speed_mps": distance / duration,
        "outcome": outcome,
        "pieces_at_start": 100,
        "fence_contacts": None,
        "min_time_to_collision_s": None if episode % 3 == 0 else 1.5,
    }


def _priced(row, events, prices):
    counted = [event for event in events if event["type"] == "counted_contact"]
    people = [event["impulse_ns"] for event in counted if event["kind"] == "pedestrian"]
    row |= injury_measures(people, prices)
    row["published_energy_kwh"] = (
        prices.rolling_resistance_force * row["distance_m"] / JOULES_PER_KWH
    )
    row["collision_impulse_ns"] = float(sum(event["impulse_ns"] for event in counted))
    row["pedestrian_contacts"] = len(people)
    for kind in ("mailbox", "trash_bin", "building_glass", "bollard", "plant"):
        hard = [
            event for event in counted if event["kind"] == kind and event["impulse_ns"] >= 100.0
        ]
        row[f"{kind}_contacts"] = len(hard)
    for event in counted:
        person = event["kind"] == "pedestrian"
        cost = injury_costs(event["impulse_ns"], prices) if person else None
        event["cost_usd"] = (
            float(cost) if person else property_cost(event["kind"], event["impulse_ns"], prices)
        )


@pytest.fixture
def navbench(capsys):
    """Call the program in this process; gives its exit status and what both streams show."""

    def call(*words):
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        return (ended.value.code, *capsys.readouterr())

    return call


@pytest.fixture
def write_run(tmp_path):
    """Write a run folder of random deliveries."""
    return writer_to(tmp_path)


@pytest.fixture(scope="session")
def write_run_to():
    """See :func:`writer_to`: for what several tests look at."""
    return writer_to


def writer_to(parent):
    """A function that writes a run folder of random deliveries into another one.

    The same seed gives the same missions and, per stack, the same rows.
    """

    def write(
        name,
        stacks=("mine",),
        episodes=40,
        seed=0,
        prices="costnav",
        crowd=1.0,
        pedestrians=20,
        change=None,
        localizer="gps",
        map_sha256="0" * 64,
    ):
        loaded = load_prices(prices)
        about = {
            "command": ["navbench", "run"],
            "stacks": [
                {"name": each, "carries": ["lidar", "gps"], "localizer": localizer}
                for each in stacks
            ],
            "episodes": episodes,
            "seed": seed,
            "map_name": "sidewalk",
            "map_sha256": map_sha256,
            "missions": "published",
            "versions": {"navbench": "0.1.0"},
        }
        world = (shipped("params") / "worlds" / "easy.yaml").read_text(encoding="utf-8")
        parameters = {
            "prices.yaml": dump_dataclass(loaded),
            "world.yaml": world.replace("count: 20", f"count: {pedestrians}"),
            "rules.yaml": (shipped("params") / "rules" / "costnav.yaml").read_text(
                encoding="utf-8"
            ),
        }
        create_run(parent / name, about, parameters)
        with RunFolder(parent / name, TABLES, episodes * len(stacks)) as folder:
            for number, stack in enumerate(stacks):
                for episode in range(episodes):
                    rng = np.random.default_rng((seed, episode, *stack.encode()))
                    row = _row(stack, number, episode, seed, rng)
                    events = _contacts(rng, crowd)
                    _priced(row, events, loaded)
                    if change is not None:
                        speed = row["average_speed_mps"]
                        change(row)
                        if row["outcome"] == "timeout":
                            row["duration_s"] = max(row["duration_s"], TIMEOUT)
                        if row["average_speed_mps"] == speed and row["distance_m"] is not None:
                            row["average_speed_mps"] = row["distance_m"] / row["duration_s"]
                    events = [{**event, "stack": stack, "episode": episode} for event in events]
                    timing = {"stack": stack, "episode": episode, "wall_s": 1.0}
                    folder.add(
                        {"row": row, "events": [] if row["error"] else events, "timing": timing}
                    )
        return parent / name

    return write
