"""The table ``rules.toml``: what tags mean, and what is put in where they are missing."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_LENGTH = re.compile(r"\s*(\d+(?:[.,]\d+)?)\s*(m|metres?|meters?|cm)?\s*")
_FEET = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(?:ft|feet|'(?:\s*(\d+(?:\.\d+)?)\")?)\s*")
_LEVELS = re.compile(r"\s*([+-]?\d+(?:\.\d+)?)\s*(?:-\s*([+-]?\d+(?:\.\d+)?)\s*)?")  # as 1 and 0-5
_LAYER = re.compile(r"\s*[+-]?\d{1,2}\s*")  # anything else says nothing
# access= and foot= of what is not for everybody
_CLOSED = ("private", "no", "use_sidepath", "military", "permit", "residents")
_FOOT, _INCH, _CENTIMETRE = 0.3048, 0.0254, 0.01  # [m]
LEAST_WIDTH, MOST_WIDTH = 0.3, 60.0  # [m] of a way's tag that is believed
WELCOME = ("yes", "designated", "permissive")  # foot=
LEAST_HEIGHT, MOST_HEIGHT = 0.05, 1000.0  # [m] of a wall's or a building's


@dataclass(frozen=True, slots=True)
class StreetRules:
    """Content of ``rules.toml``; lengths in [m]."""

    walk_widths: dict[str, float]  # by highway=
    carriageways: dict[str, float]  # by highway=
    street: dict[str, Any]
    building: dict[str, float]
    barriers: dict[str, tuple[str, float, float]]  # kind, thickness, height by barrier=
    furniture: dict[str, str]  # entry of the catalogue by key=value
    catalogue: dict[str, tuple[float, float, float, str]]  # length, depth, height, kind
    filling: dict[str, float]  # distance between pieces, by entry of the catalogue


def _load() -> StreetRules:
    text = Path(__file__).with_name("rules.toml").read_text(encoding="utf-8")
    return StreetRules(**tomllib.loads(text))


RULES = _load()


def tagged_length(tags: dict[str, str], key: str) -> float | None:
    """A width in [m] that a tag gives; None: there is none, or none that is believed."""
    return _within(tags.get(key, ""), LEAST_WIDTH, MOST_WIDTH)


def tagged_height(tags: dict[str, str], key: str = "height") -> float | None:
    """A height in [m] that a tag gives; None: there is none, or none that is believed."""
    return _within(tags.get(key, ""), LEAST_HEIGHT, MOST_HEIGHT)


def tagged_width(tags: dict[str, str]) -> float | None:
    """The width of a way in [m], measured or estimated; None: no tag gives one."""
    measured = tagged_length(tags, "width")
    if measured is None:
        return tagged_length(tags, "est_width")
    return measured


def _within(text: str, least: float, most: float) -> float | None:
    """The length in [m] of a tag's text if it is one between two others."""
    metres, feet = _LENGTH.fullmatch(text), _FEET.fullmatch(text)
    if metres is not None:
        length = float(metres[1].replace(",", "."))
        if metres[2] == "cm":
            length *= _CENTIMETRE
    elif feet is not None:
        length = _FOOT * float(feet[1]) + _INCH * float(feet[2] or 0.0)
    else:
        return None
    if not least <= length <= most:
        return None
    return length


def walk_kind(tags: dict[str, str]) -> str:
    """The entry of ``walk_widths`` that a way for people has; empty: it is none."""
    highway = tags.get("highway", "")
    if highway == "cycleway" and tags.get("foot") not in WELCOME:
        return ""
    if highway == "service" and tags.get("service") == "parking_aisle":
        return ""
    role = tags.get("footway") or tags.get("path") or tags.get("cycleway") or ""
    if highway in ("footway", "path", "cycleway") and role in ("sidewalk", "crossing"):
        return role
    if highway not in RULES.walk_widths:
        return ""
    return highway


def walk_width(tags: dict[str, str], kind: str) -> tuple[float, bool]:
    """Width [m] of a way for people, and whether a tag says so."""
    tagged = tagged_width(tags)
    if tagged is None or kind == "steps":  # mappers give steps their depth or number there
        return RULES.walk_widths[kind], False
    return tagged, True


def carriageway_width(tags: dict[str, str]) -> float:
    """Width [m] of a street between its kerbs, parking included."""
    tagged = tagged_width(tags)
    if tagged is not None:
        return tagged
    width, street = RULES.carriageways[tags["highway"]], RULES.street
    lanes = tags.get("lanes", "")
    if lanes.isdecimal() and 1 <= int(lanes) <= 8:
        width = int(lanes) * float(street["lane_width"])
    return width + _parking_sides(tags) * float(street["parking_width"])


def _parking_sides(tags: dict[str, str]) -> int:
    sides = 0
    for key in ("parking:lane", "parking"):
        sides += 2 * (tags.get(f"{key}:both") in ("parallel", "lane"))
        sides += tags.get(f"{key}:left") in ("parallel", "lane")
        sides += tags.get(f"{key}:right") in ("parallel", "lane")
    return min(sides, 2)


def sidewalk_sides(tags: dict[str, str]) -> dict[str, str]:
    """Which sides of a street have a sidewalk of their own: 'left', 'right' -> 'tag' or 'rule'."""
    if tags.get("access") == "private" and not is_open(tags):
        return {}
    tagged = tags.get("sidewalk") or tags.get("sidewalk:both") or ""
    is_filled_in = tags["highway"] in RULES.street["has_sidewalks"] and is_open_on_foot(tags)
    sides = {}
    for side in ("left", "right"):
        value = tags.get(f"sidewalk:{side}", tagged)
        if {"both", "yes", side} & set(value.split(";")):
            sides[side] = "tag"
        elif not value and is_filled_in:
            sides[side] = "rule"
    return sides


def is_open(tags: dict[str, str]) -> bool:
    """Whether people may walk there; what is said of people counts before what is said of all."""
    return tags.get("foot", tags.get("access")) not in _CLOSED


def is_open_on_foot(tags: dict[str, str]) -> bool:
    """Whether nothing forbids people in particular; access=no may be of a street for buses."""
    return tags.get("foot") not in _CLOSED


def is_for_cars_only(tags: dict[str, str]) -> bool:
    """Whether nobody walks over a street where no way is mapped."""
    is_motorway = tags.get("highway") in ("motorway", "motorway_link")
    return is_motorway or tags.get("motorroad") == "yes"


def _is_on_ground_floor(level: str) -> bool:
    """Whether a list of levels, as ``-1;0`` and ``0-5``, is empty or has level 0."""
    for text in re.split("[;,]", level):
        levels = _LEVELS.fullmatch(text)
        if levels is not None and float(levels[1]) <= 0.0 <= float(levels[2] or levels[1]):
            return True
    return not level.strip()


def is_below_or_above(tags: dict[str, str]) -> bool:
    """Whether a thing is not on the ground: in a tunnel, indoors, on a deck, or not built."""
    passage = tags.get("tunnel") == "building_passage"
    in_tunnel = tags.get("tunnel", "no") not in ("no", "building_passage")
    if in_tunnel or tags.get("indoor", "no") != "no" or tags.get("location") == "underground":
        return True
    if not _is_on_ground_floor(tags.get("level", "")):
        return True
    layer = _LAYER.fullmatch(tags.get("layer", "0"))
    if layer is None or passage:
        return False
    is_water = "waterway" in tags or tags.get("natural") == "water"
    least = -5 if is_water else 0  # mappers put rivers below their bridges
    return not least <= int(layer[0]) <= 1
