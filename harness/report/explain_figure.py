"""The seconds before a costed event as a figure.

The place, and what was done, met, believed and scored over time.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.explain.evidence import WEIGHTED, Evidence
from harness.explain.seconds import NEAR, Seconds
from harness.report.figures import save_as
from harness.report.map_picture import draw_scene
from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from navstack.geometry import transform_points
from navstack.types import FloatArray, Pose2D

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_INCH, HEIGHT_INCH = 7.1, 4.1  # both columns of a paper
FORMATS = (".png", ".pdf", ".svg")
# [m] around what is shown, [m] of its width, its height over its width
MARGIN, LEAST, SHAPE = 1.5, 7.0, 1.25
SHOWN = 5  # critics or terms that have a colour of their own
ROBOT, BELIEF, PERSON, TRACK, CONTACT, PLAN = (
    "#0b6e4f",
    "#3b82f6",
    "#7b3fa0",
    "#e07b00",
    "#d1242f",
    "#6b7280",
)
SCORES = ("#1f5fa8", "#e07b00", "#0b6e4f", "#a21caf", "#b45309", "#9ca3af")


def draw_seconds(
    evidence: Evidence, seconds: Seconds, scene: Scene | None, paths: Sequence[Path]
) -> None:
    """Draw the seconds before a moment.

    Args:
        evidence: of the delivery.
        seconds: to be drawn.
        scene: the map behind; None: white.
        paths: files to write; their suffixes say the format.

    Raises:
        InputError: a file cannot be written.
    """

    def draw(figure: "Figure") -> None:
        parts: Any = figure.subfigures(1, 2, width_ratios=(1.0, 1.25))
        place, strips = parts
        _draw_place(place.subplots(), evidence, seconds, scene)
        _draw_strips(strips.subplots(4, 1, sharex=True), seconds)

    save_as(paths, (WIDTH_INCH, HEIGHT_INCH), draw, font_size=7.0)


def _draw_place(axes: "Axes", evidence: Evidence, seconds: Seconds, scene: Scene | None) -> None:
    area = _area(seconds)
    if scene is not None:
        draw_scene(axes, scene, area)
    axes.set(xlim=(area.x0, area.x1), ylim=(area.y0, area.y1), aspect="equal")
    plans = [corners for stamp, corners in evidence.plans if stamp <= seconds.moment.stamp]
    if plans and len(plans[-1]):
        axes.plot(*plans[-1].T, color=PLAN, lw=1.0, ls=(0, (4, 2)), zorder=5, label="plan")
    _draw_people(axes, evidence, seconds)
    axes.plot(*seconds.robot[:, :2].T, color=ROBOT, lw=2.8, zorder=7, label="robot")
    believed = _believed(seconds)
    if len(believed):
        axes.plot(*believed.T, color=BELIEF, lw=0.9, zorder=8, label="believed")
    tracks = [points for points in seconds.tracks if len(points)]
    if tracks:
        axes.plot(
            *np.vstack(tracks).T, ls="", marker=".", ms=1.6, color=TRACK, zorder=6, label="tracks"
        )
    for place, alpha in ((0, 0.3), (-1, 0.85)):
        outline = transform_points(Pose2D(*seconds.robot[place].tolist()), evidence.footprint)
        axes.fill(*outline.T, fc=ROBOT, ec="white", lw=0.6, alpha=alpha, zorder=7)
    event = seconds.moment.event
    if event is not None:
        axes.plot(
            event["x_m"], event["y_m"], ls="", marker="X", ms=8, mfc=CONTACT, mec="white", zorder=10
        )
    axes.set_title(
        f"event {seconds.moment.number}: {seconds.moment.kind.replace('_', ' ')}",
        fontsize=8,
        loc="left",
    )
    axes.legend(
        loc="upper right",
        fontsize=6,
        frameon=True,
        framealpha=0.85,
        edgecolor="none",
        borderpad=0.3,
    )


def _draw_people(axes: "Axes", evidence: Evidence, seconds: Seconds) -> None:
    """Where people walked, and where they were at the moment; the one that matters filled."""
    from matplotlib.patches import Circle

    for number in range(seconds.people.shape[1]):
        path = seconds.people[:, number]
        path = path[np.isfinite(path).all(axis=1)]
        if not len(path):
            continue
        matters = number == seconds.person
        axes.plot(
            *path.T,
            color=PERSON,
            lw=1.2 if matters else 0.5,
            alpha=1.0 if matters else 0.5,
            zorder=6,
        )
        if matters:
            style: Any = {"fc": PERSON, "ec": "white"}
        else:
            style = {"fc": "white", "ec": PERSON, "alpha": 0.7}
        axes.add_patch(
            Circle(tuple(path[-1]), evidence.body.person_radius, lw=0.7, zorder=6, **style)
        )
    if seconds.person is not None:
        axes.plot([], [], color=PERSON, lw=1.2, label=f"person {seconds.person}")


def _believed(seconds: Seconds) -> FloatArray:
    """Believed positions (k, 2) [m]."""
    rows = [(row["believed_x_m"], row["believed_y_m"]) for row in seconds.decisions]
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def _area(seconds: Seconds) -> Rect:
    """What is shown around robot and person."""
    points = [seconds.robot[:, :2]]
    if seconds.person is not None:
        person = seconds.people[:, seconds.person]
        there = person[np.isfinite(person).all(axis=1)]
        latest = max(2, len(person) // 2)
        points.append(there[-latest:])
    together = np.vstack(points)
    low = together.min(axis=0) - MARGIN
    high = together.max(axis=0) + MARGIN
    width, height = (high - low).tolist()
    half = 0.5 * max(LEAST, width, height / SHAPE)
    x, y = ((low + high) / 2.0).tolist()
    return Rect(x - half, y - SHAPE * half, x + half, y + SHAPE * half)


def _draw_strips(strips: Sequence["Axes"], seconds: Seconds) -> None:
    speed, person, belief, scores = strips
    at = seconds.at
    speed.plot(at, seconds.speed, color=ROBOT, label="driven")
    speed.step(
        at, seconds.command[:, 0], where="post", color="black", lw=0.9, ls="--", label="commanded"
    )
    speed.set_ylabel("speed [m/s]")
    speeds = np.concatenate((seconds.speed, seconds.command[:, 0]))
    speed.set_ylim(min(0.0, 1.1 * float(speeds.min())), max(0.1, 1.1 * float(speeds.max())))
    _draw_person(person, seconds)
    belief.plot(seconds.decided_at, seconds.decided_off, color=BELIEF, label="position error")
    if not np.isnan(seconds.track_error).all():
        belief.plot(at, seconds.track_error, color=TRACK, label="track error")
    belief.set_ylabel("error [m]")
    belief.set_ylim(bottom=0.0)
    _draw_scores(scores, seconds)
    scores.set_xlabel("time to the event [s]")
    for axes in strips:
        axes.axvline(0.0, color=CONTACT, lw=0.8)
        axes.set_xlim(at[0], max(0.02 * -at[0], 0.02))
        if axes.get_legend_handles_labels()[0]:
            axes.legend(
                loc="center left",
                bbox_to_anchor=(1.0, 0.5),
                fontsize=6,
                frameon=False,
                handlelength=1.2,
            )


def _draw_person(axes: "Axes", seconds: Seconds) -> None:
    """Distance of the person that matters, and how fast the gap closes."""
    axes.set_ylabel("person [m], [m/s]")
    if seconds.person is None:
        nobody = f"nobody within {NEAR:g} m"
        axes.text(
            0.5, 0.5, nobody, transform=axes.transAxes, ha="center", va="center", color=PERSON
        )
        return
    axes.plot(seconds.at, seconds.distance, color=PERSON, label="distance")
    axes.plot(seconds.at, seconds.closing, color=PERSON, lw=0.8, ls="--", label="closing")
    axes.axhline(0.0, color="black", lw=0.4)


def _draw_scores(axes: "Axes", seconds: Seconds) -> None:
    """Weighted scores of what was chosen, the largest critics stacked."""
    axes.set_ylabel("score")
    rows = [row for row in seconds.decisions if row["total_score"] is not None]
    names: list[str] = []
    if rows:
        names = [key for key in rows[0] if key.endswith(WEIGHTED)]
    if not names:
        axes.text(0.5, 0.5, "nothing is scored", transform=axes.transAxes, ha="center", va="center")
        return
    values = np.array([[row[name] or 0.0 for name in names] for row in rows])
    stamps = np.array([row["stamp_s"] for row in rows]) - seconds.moment.stamp
    order = np.argsort(-np.abs(values).mean(axis=0), kind="stable")
    order = order[np.abs(values[:, order]).max(axis=0) > 0.0]
    shown = [values[:, place] for place in order[:SHOWN]]
    labels = [names[place].removesuffix(WEIGHTED) for place in order[:SHOWN]]
    if len(order) > SHOWN:
        shown.append(values[:, order[SHOWN:]].sum(axis=1))
        labels.append("others")
    axes.stackplot(stamps, *shown, labels=labels, colors=SCORES[: len(shown)], lw=0.0, alpha=0.85)
