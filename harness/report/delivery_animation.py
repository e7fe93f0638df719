"""An animation of the worst moment of a delivery: who met whom, and what became of the popcorn.

Usage: python -m harness.report.delivery_animation GIF [--stack NAME] [--seed N] [--episode N] ...
(drives the delivery; the moment is that of the strongest contact).
"""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.episode.factory import Parts, robot_of, scene_of, world_params
from harness.metrics import Row, event_rows
from harness.report.gif_file import drawn, write_frames
from harness.report.map_picture import draw_scene
from harness.task.study import EpisodeTask, make_study
from harness.world.shapes import Rect
from harness.world.truth import Truth
from harness.world.world_params import CargoParams
from navstack.errors import InputError
from navstack.geometry import transform_points
from navstack.types import Belief, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE, AFTER = 2.5, 3.0  # [s] around the moment
FRAMES_PER_SECOND = 10.0  # shown; simulated time runs at half speed
SLOW_DOWN = 2.0
REACH = 4.5  # [m] shown around the robot
WIDTH_INCH, HEIGHT_INCH, DPI = 8.0, 4.4, 80
SAME = ("type", "stamp_s", "partner", "partner_id", "impulse_ns")  # of contacts that come out again
ROBOT, PERSON, CONTACT, PIECE, GONE = "#0b6e4f", "#7b3fa0", "#d1242f", "#e3a008", "#b42318"


@dataclass(frozen=True, slots=True)
class Frame:
    """What is shown of one instant."""

    truth: Truth
    pieces: FloatArray  # (n, 3) [m] centres, frame of the bucket's floor


def drive(task: EpisodeTask) -> list[Frame]:
    """Every tick of a delivery."""
    generators = task.generators()
    parts = Parts(task)
    mission, world = parts.mission(generators["mission"]), parts.world()
    brain = parts.brain(world)
    observation = world.reset(mission, generators)
    brain.reset(
        mission.goal, Belief(mission.start), generators["planner"], generators["localizer"], generators["controller"]
    )
    frames = [Frame(world.truth, world.cargo_pieces)]
    while parts.rules.judge(world.truth, mission.goal) is None:
        observation = world.step(brain.tick(observation))
        frames.append(Frame(world.truth, world.cargo_pieces))
    world.close_episode()
    frames.append(Frame(world.truth, world.cargo_pieces))
    return frames


def animate(task: EpisodeTask, gif: Path, stored: Sequence[Row] | None = None) -> None:
    """Drive a delivery and write its worst moment as an animated GIF.

    Args:
        task: the delivery.
        gif: file to write.
        stored: its rows of ``events.parquet``; None: it was not driven before.

    Raises:
        InputError: the robot touched nothing, or something else than stored; or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    frames = drive(task)
    if stored is not None:
        _check_same(task, frames[-1].truth, stored)
    contacts = frames[-1].truth.contacts
    if not contacts:
        raise InputError(f"{task.stack.name} touched nothing in episode {task.episode} of seed {task.seed}")
    moment = max(contacts, key=lambda contact: contact.impulse).stamp
    figure = Figure(figsize=(WIDTH_INCH, HEIGHT_INCH), dpi=DPI)
    FigureCanvasAgg(figure)
    above, beside = figure.add_axes((0.02, 0.04, 0.52, 0.86)), figure.add_axes((0.62, 0.22, 0.35, 0.62))
    pictures = []
    for frame in shown(frames, moment):
        above.clear()
        beside.clear()
        figure.texts.clear()
        _draw_place(above, task, frame, contacts)
        _draw_bucket(beside, task, frame)
        _draw_facts(figure, frame, moment)
        pictures.append(drawn(figure))
    write_frames(gif, pictures, FRAMES_PER_SECOND)


def _check_same(task: EpisodeTask, truth: Truth, stored: Sequence[Row]) -> None:
    """Check that a delivery touched what its events say.

    Raises:
        InputError: it did not.
    """
    driven = event_rows(truth, [0.0] * len(truth.counted_contacts))
    now, then = (Counter(tuple(row[key] for key in SAME) for row in rows) for rows in (driven, stored))
    if now != then:
        raise InputError(
            f"episode {task.episode} of {task.stack.name} comes out otherwise when it is driven again ({now.total()} "
            f"contacts that are not the {then.total()} stored): other libraries, or another kind of machine; show it "
            "where it was driven"
        )


def shown(frames: Sequence[Frame], moment: float) -> list[Frame]:
    """The frames around a moment [s], evenly spaced in time."""
    stamps = np.array([frame.truth.stamp for frame in frames])
    wanted = np.arange(moment - BEFORE, moment + AFTER, 1.0 / (FRAMES_PER_SECOND * SLOW_DOWN))
    return [frames[k] for k in np.unique(np.searchsorted(stamps, wanted[wanted <= stamps[-1]]))]


def _draw_place(axes: "Axes", task: EpisodeTask, frame: Frame, contacts: Sequence[Any]) -> None:
    from matplotlib.patches import Circle, Polygon

    truth, robot = frame.truth, robot_of(task.stack.robot)
    x, y = truth.pose.x, truth.pose.y
    draw_scene(axes, scene_of(task.map_name), Rect(x - REACH, y - REACH, x + REACH, y + REACH))
    radius = world_params(task.world, task.pedestrians, task.people).people.radius
    axes.add_patch(Polygon(transform_points(truth.pose, robot.polygon), fc=ROBOT, ec="white", lw=1.0, zorder=6))
    axes.arrow(
        x, y, 0.5 * math.cos(truth.pose.yaw), 0.5 * math.sin(truth.pose.yaw), color="white", width=0.02, zorder=7
    )
    for px, py, vx, vy in truth.pedestrians.tolist():
        if math.hypot(px - x, py - y) < 2.0 * REACH:
            axes.add_patch(Circle((px, py), radius, fc=PERSON, ec="white", lw=1.0, zorder=6))
            axes.plot((px, px + 0.6 * vx), (py, py + 0.6 * vy), color=PERSON, lw=1.5, zorder=6)
    touching = [c for c in contacts if c.stamp <= truth.stamp <= c.stamp + max(c.duration, 0.4)]
    for contact in touching:
        axes.plot(contact.x, contact.y, marker="X", ms=14, color=CONTACT, mec="white", zorder=9)
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="")


def _draw_bucket(axes: "Axes", task: EpisodeTask, frame: Frame) -> None:
    from matplotlib.patches import Circle

    cargo: CargoParams = world_params(task.world, task.pedestrians, task.people).cargo
    half, height = 50.0 * cargo.bucket_width, 100.0 * cargo.bucket_height  # [cm]
    axes.plot((-half, -half, half, half), (height, 0.0, 0.0, height), color="#475569", lw=3.0, zorder=5)
    order = np.argsort(frame.pieces[:, 1]) if len(frame.pieces) else np.empty(0, dtype=np.intp)
    for px, _, pz in (100.0 * frame.pieces[order]).tolist():
        colour = PIECE if abs(px) <= half and 0.0 <= pz <= height else GONE
        axes.add_patch(Circle((px, pz), 100.0 * cargo.piece_radius, fc=colour, ec="white", lw=0.6))
    axes.set(xlim=(-3.0 * half, 3.0 * half), ylim=(-0.6 * height, 2.2 * height), aspect="equal")
    axes.set_title("the bucket from its right side [cm]", fontsize=9)
    axes.tick_params(labelsize=7)


def _draw_facts(figure: Any, frame: Frame, moment: float) -> None:
    truth = frame.truth
    counted = [contact.impulse for contact in truth.counted_contacts]
    cargo = truth.cargo
    lost = f"\npieces lost {cargo.pieces_outside} of {cargo.pieces_at_start}" if cargo else ""
    figure.text(0.02, 0.93, f"{truth.stamp - moment:+.2f} s", fontsize=12, family="monospace")
    figure.text(
        0.62,
        0.04,
        f"speed {math.hypot(truth.twist.linear_x, truth.twist.linear_y):.2f} m/s   "
        f"tilt {math.degrees(truth.tilt):.0f} deg\n"
        f"counted contacts {len(counted)}: {sum(counted):.0f} N s{lost}",
        fontsize=9,
        family="monospace",
    )


def main() -> None:
    """Read the arguments and animate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gif", type=Path)
    parser.add_argument("--stack", default="nav2-gps")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--episode", type=int, default=0)
    parser.add_argument("--world", default="costnav")
    parser.add_argument("--pedestrians", type=int)
    given = parser.parse_args()
    study = make_study(
        stacks=[given.stack],
        episodes=given.episode + 1,
        seed=given.seed,
        world=given.world,
        pedestrians=given.pedestrians,
    )
    animate(list(study.tasks())[given.episode], given.gif)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
