"""What made a robot tip over or get stuck: who pushed it, what it stood on, and why it stood."""

import re
from collections.abc import Sequence

import numpy as np
import shapely

from harness.economics.accountings import COUNTED, EVENT, PERSON
from harness.explain.evidence import Evidence
from harness.explain.moments import ASSISTANCE, Moment
from harness.explain.seconds import Seconds
from harness.metrics.columns import Row
from harness.world.map.scene import Scene
from harness.world.physics.elevation import elevation_of
from navstack.geometry import transform_points
from navstack.types import FloatArray, Pose2D

TIPPED = "orientation"  # reason of an outcome, as harness.world.outcome has it
LASTING = 1.0  # [s] from which a contact is told by how long it lasted
AT_REST = 1e-3  # [m/s], [rad/s] of commands to a robot that is to stand
GAVE_UP = re.compile(r"([\d.]+) s gave up: (.*)")
WALKED_IN = {
    "person_into_robot": "{who} moved into it",
    "person_into_standing_robot": "{who} walked into it as it stood",
}


def has_tipped(evidence: Evidence, moment: Moment) -> bool:
    """Whether that is what the moment is."""
    return moment.kind == ASSISTANCE and evidence.row["reason"] == TIPPED


def tipping(evidence: Evidence, seconds: Seconds) -> list[str]:
    """Sentences on what made it tip over; an empty one where nothing is known."""
    ground = _step(evidence, seconds) or _level(evidence, seconds)
    return [_touched(evidence.events, seconds), ground, _stood(evidence)]


def held_up(evidence: Evidence, seconds: Seconds) -> list[str]:
    """Sentences on what a robot that did not get on had met, and on the step that it stood on."""
    touches = _touches(evidence.events, seconds)
    sentences = []
    if touches:
        sentences.append(f"Before that, {' and '.join(touches)}.")
    sentences.append(_step(evidence, seconds))
    away = evidence.row["off_walkable_time_s"] or 0.0
    if away >= LASTING:
        sentences.append(f"It spent {away:.0f} s off the walkable ground.")
    return sentences


def _touched(events: Sequence[Row], seconds: Seconds) -> str:
    """Whom and what it touched in the seconds before, the last one last."""
    touches = _touches(events, seconds)
    if touches:
        return f"Before it tipped over, {' and '.join(touches)}."
    known = _contacts(events)
    if not known:
        return "It had touched nobody and nothing on its way."
    last = max(event["stamp_s"] for event in known)
    return f"It touched nobody and nothing in the last {seconds.moment.stamp - last:.0f} s."


def _contacts(events: Sequence[Row]) -> list[Row]:
    return [event for event in events if event["type"] in (COUNTED, EVENT)]


def _touches(events: Sequence[Row], seconds: Seconds) -> list[str]:
    """Whom and what it touched in the seconds before, the last one last."""
    known = [each for each in _contacts(events) if each["stamp_s"] <= seconds.moment.stamp]
    partners: dict[tuple[str, int], list[Row]] = {}
    for event in known:
        partners.setdefault((event["kind"], event["partner_id"]), []).append(event)
    touches = []
    for own in partners.values():
        until = max(event["stamp_s"] + (event["duration_s"] or 0.0) for event in own)
        if until >= seconds.since:
            touches.append((until, _touch(own, until, seconds.moment.stamp)))
    return [text for _, text in sorted(touches)]


def _touch(events: Sequence[Row], until: float, stamp: float) -> str:
    """What contacts with one partner that ended at ``until`` [s] came to, at ``stamp`` [s]."""
    last = max(events, key=lambda event: (event["stamp_s"], event["type"] == EVENT))
    strongest = max(event["impulse_ns"] for event in events)
    who = f"the {last['kind'].replace('_', ' ')}"
    if last["partner"] == PERSON:
        who = f"person {last['partner_id']}"
    text = WALKED_IN.get(last["fault"], "it moved into {who}").format(who=who)
    lasted = until - max(
        event["stamp_s"] for event in events if event["type"] == EVENT or len(events) == 1
    )
    when = f"{max(stamp - until, 0.0):.1f} s before"
    if lasted > LASTING:
        when = f"touching it for {lasted:.0f} s until {when}"
    return f"{text} ({strongest:.0f} N s, {when})"


def _level(evidence: Evidence, seconds: Seconds) -> str:
    """On what level ground the corners of its footprint were; empty: the map is not known."""
    if evidence.scene is None:
        return ""
    corners = _corners(evidence.footprint, seconds.robot[-1])
    kinds = [kind_at(evidence.scene, corner) for corner in corners]
    return f"It was on level ground ({' and '.join(dict.fromkeys(kinds))})."


def _step(evidence: Evidence, seconds: Seconds) -> str:
    """The step below the corners of its footprint; empty: there is none, or no map."""
    if evidence.scene is None:
        return ""
    elevation = elevation_of(evidence.scene)
    heights = []
    for pose in seconds.robot:
        corners = _corners(evidence.footprint, pose)
        heights.append([elevation.level(x, y) for x, y in corners.tolist()])
    levels = np.array(heights)
    corners = _corners(evidence.footprint, seconds.robot[-1])
    kinds = [kind_at(evidence.scene, corner) for corner in corners]
    step = float(np.ptp(levels[-1]))
    if step == 0.0:
        return ""
    is_low = levels[-1] == levels[-1].min()
    low = kinds[int(np.flatnonzero(is_low)[0])]
    high = kinds[int(np.flatnonzero(~is_low)[0])]
    level = np.flatnonzero(np.ptp(levels, axis=1) == 0.0)
    since = f"for all of the {-seconds.at[0]:.1f} s"
    if len(level):
        since = f"from {-seconds.at[int(level[-1]) + 1]:z.1f} s before"
    side = _side(evidence.footprint, is_low)
    return (
        f"It was over a step of {step:.2f} m {since}: {side} over the {low}, the rest over the "
        f"{high}."
    )


def _corners(footprint: FloatArray, pose: FloatArray) -> FloatArray:
    """Corners (V, 2) [m] in the map frame of a footprint at a pose x, y [m], yaw [rad]."""
    return transform_points(Pose2D(*pose.tolist()), footprint)


def kind_at(scene: Scene, point: FloatArray) -> str:
    """The use of the ground at a point (2,) [m]; of zones that overlap the later counts."""
    for zone in reversed(scene.zones):
        if shapely.intersects_xy(shapely.Polygon(zone.polygon), *point):
            return zone.kind.replace("_", " ")
    return "ground"


def _side(footprint: FloatArray, chosen: FloatArray) -> str:
    """Where on the robot the chosen corners are."""
    x, y = footprint[chosen].mean(axis=0) - footprint.mean(axis=0)
    if abs(x) >= abs(y):
        return "its front" if x > 0.0 else "its rear"
    return "its left" if y > 0.0 else "its right"


def _stood(evidence: Evidence) -> str:
    """Since when and why it was to stand; empty: it was not."""
    last = (evidence.row.get("navigator_history") or "").rpartition("; ")[2]
    if found := GAVE_UP.fullmatch(last):  # else its goal was sent again
        stamp, why = found.groups()
        error = evidence.row["navigator_error"]
        return f"At {stamp} s the navigator gave up and let it stand: {why} ({error})."
    moves = np.flatnonzero(np.abs(evidence.trace[:, 9:11]).max(axis=1) > AT_REST)
    last = int(moves[-1]) if len(moves) else 0
    stood = float(evidence.stamps[-1] - evidence.stamps[last])
    if stood < LASTING:
        return ""
    return f"It was commanded to stand for the last {stood:.1f} s."
