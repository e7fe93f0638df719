"""Parameter files whose values are wrong, or would cost all memory or all time."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from .case import MAP_TEXT, Case, Make, changed, put, run_arguments, shipped_text, write_map

_HUGE = "9" * 400
Changes = Mapping[str, str]

# kind: folder and name of the valid file, option of navbench run, and what is wrong: changes and
# what must be said
OPTIONS: dict[str, tuple[str, str, str, dict[str, tuple[Changes, str]]]] = {
    "robot": (
        "robots",
        "segway_e1",
        "--robot",
        {
            "mass is a text": ({"mass: 50.0": "mass: heavy"}, "mass"),
            "mass is nothing": ({"mass: 50.0": "mass:"}, "mass"),
            "mass is not a number": ({"mass: 50.0": "mass: .nan"}, "mass"),
            "mass is infinite": ({"mass: 50.0": "mass: .inf"}, "mass"),
            "mass has 400 digits": ({"mass: 50.0": f"mass: {_HUGE}"}, "mass"),
            "mass is astronomic": ({"mass: 50.0": "mass: 1.0e+300"}, "mass"),
            "mass is a hair's breadth": ({"mass: 50.0": "mass: 1.0e-300"}, "mass"),
            "mass is misspelt": ({"mass: 50.0": "mas: 50.0"}, "did you mean 'mass'"),
            "height is zero": ({"height: 1.15": "height: 0"}, "height"),
            "size is a kilometre": (
                {"[[0.14, 0.25], [0.14, -0.25],": "[[900, 900], [900, -900],"},
                "footprint",
            ),
            "footprint has a corner of three": ({"[0.14, 0.25]": "[0.14, 0.25, 1.0]"}, "footprint"),
            "footprint has two corners": ({", [-0.607, -0.25], [-0.607, 0.25]]": "]"}, "footprint"),
            "footprint is a line": (
                {
                    "0.25]": "0.0]",
                    "-0.25]": "0.0]",
                    ", -0.25], [-0.607, 0.25]": ", 0.0], [0.3, 0.0]",
                },
                "footprint",
            ),
            "footprint has 9000 corners": (
                {"[[0.14, 0.25]": f"[{'[0.14, 0.25], ' * 9000}[0.14, 0.25]"},
                "given.yaml",
            ),
            "speed is astronomic": ({"max_speed: 3.56": "max_speed: 1.0e+200"}, "max_speed"),
            "bucket is beside itself": ({"bucket: [": "bucket: [1.0e+300, 0, 0] # "}, "bucket"),
        },
    ),
    "world": (
        "worlds",
        "easy",
        "--world",
        {
            "physics are endless": ({"rate: 120.0": "rate: 1.0e+12"}, "rate"),
            "solver never ends": (
                {"solver_iterations: 50": "solver_iterations: 2000000000"},
                "solver_iterations",
            ),
            "solver has 400 digits": (
                {"solver_iterations: 50": f"solver_iterations: {_HUGE}"},
                "solver_iterations",
            ),
            "gravity is astronomic": ({"gravity: 9.81": "gravity: 1.0e+300"}, "gravity"),
            "people are a billion": ({"count: 20": "count: 1000000000"}, "count"),
            "people have a billion goals": (
                {"count: 20": "count: 20\n  goals: 1000000000"},
                "goals",
            ),
            "people are giants": ({"radius: 0.3": "radius: 1.0e+9"}, "radius"),
            "people are light": ({"speed: 1.0": "speed: 3.0e+8"}, "speed"),
            "people follow an unknown model": ({"random_walk": "random_wlak"}, "random_walk"),
            "people follow a recording that climbs": (
                {"random_walk": "replay\n  replay: {file: ../../../etc/passwd}"},
                "passwd",
            ),
            "people follow a device": (
                {"random_walk": "replay\n  replay: {file: /dev/zero}"},
                "/dev/zero",
            ),
            "cargo is a billion pieces": ({"pieces: 50": "pieces: 1000000000"}, "pieces"),
            "cargo weighs nothing": ({"piece_mass: 0.001": "piece_mass: 0"}, "piece_mass"),
            "cool_down is a half": ({"cool_down: 30": "cool_down: 0.5"}, "cool_down"),
            "a key is unknown at depth": (
                {"  rate: 120.0": "  rates: 120.0"},
                "did you mean 'rate'",
            ),
            "a section is a list": (
                {"physics:\n  rate: 120.0": "physics: []\nmore:\n  rate: 120.0"},
                "given.yaml",
            ),
        },
    ),
    "rules": (
        "rules",
        "costnav",
        "--rules",
        {
            "timeout is infinite": ({"timeout: 241.0": "timeout: .inf"}, "timeout"),
            "timeout is a century": ({"timeout: 241.0": "timeout: 3.0e+9"}, "timeout"),
            "timeout is negative": ({"timeout: 241.0": "timeout: -1"}, "timeout"),
            "arrival radius is not a number": (
                {"arrival_radius: 2.0": "arrival_radius: .nan"},
                "arrival_radius",
            ),
            "arrival radius is negative": (
                {"arrival_radius: 2.0": "arrival_radius: -2.0"},
                "arrival_radius",
            ),
            "tilt is a truth": ({"max_tilt: 0.5": "max_tilt: yes"}, "max_tilt"),
            "impulse is missing": ({"impulse_health: 177.78": ""}, "impulse_health"),
            "spoiled share is two": (
                {"spoiled_fraction: 0.05": "spoiled_fraction: 2"},
                "spoiled_fraction",
            ),
        },
    ),
    "prices": (
        "prices",
        "costnav",
        "--prices",
        {
            "robot costs nothing": ({"value: 8000": "value: 0"}, "robot_cost"),
            "robot costs infinitely": ({"value: 8000": "value: .inf"}, "robot_cost"),
            "robot costs 400 digits": ({"value: 8000": f"value: {_HUGE}"}, "robot_cost"),
            "robot is paid in rupees": ({"unit: USD/robot": "unit: INR/robot"}, "INR"),
            "robot's price is a list": ({"value: 8000": "value: [8000]"}, "robot_cost"),
            "a price is missing": ({"robot_cost:": "robot_csot:"}, "robot_cost"),
        },
    ),
}
SENSORS: dict[str, tuple[Changes, str]] = {
    "beams are a billion": ({"beams: 360": "beams: 1000000000"}, "beams"),
    "beams are none": ({"beams: 360": "beams: 0"}, "beams"),
    "beams are a half": ({"beams: 360": "beams: 0.5"}, "beams"),
    "range is infinite": ({"range_max: 30.0": "range_max: .inf"}, "range_max"),
    "range is astronomic": ({"range_max: 30.0": "range_max: 1.0e+300"}, "range_max"),
    "rate is zero": ({"rate: 10.0": "rate: 0"}, "rate"),
    "rate is a gigahertz": ({"rate: 10.0": "rate: 1.0e+9"}, "rate"),
    "noise is negative": ({"noise_std: 0.02": "noise_std: -0.02"}, "noise_std"),
    "noise is astronomic": ({"noise_std: 0.02": "noise_std: 1.0e+300"}, "noise_std"),
    "mount has no yaw": (
        {"mount: {x: -0.23, y: 0.0, yaw: 0.0}": "mount: {x: .nan, y: 0.0, yaw: 0.0}"},
        "mount",
    ),
}
STACKS: dict[str, tuple[Changes, str]] = {
    "navigator is unknown": ({"navigator: nav2": "navigator: nav3"}, "nav3"),
    "localizer is unknown": ({"localizer: gps": "localizer: gsp"}, "gsp"),
    "localizer is a list": ({"localizer: gps": "localizer: [gps]"}, "localizer"),
    "Nav2 file is nowhere": ({"nav2_file: gps_ekf": "nav2_file: nowhere.yaml"}, "nowhere.yaml"),
    "Nav2 file is the stack itself": (
        {"nav2_file: gps_ekf": "nav2_file: given.yaml"},
        "given.yaml",
    ),
    "Nav2 file climbs to a text": (
        {"nav2_file: gps_ekf": f"nav2_file: {'../' * 12}etc/passwd"},
        "passwd",
    ),
    "Nav2 file is a device": ({"nav2_file: gps_ekf": "nav2_file: /dev/zero"}, "/dev/zero"),
    "Nav2 file is the memory of this process": (
        {"nav2_file: gps_ekf": "nav2_file: /proc/self/mem"},
        "/mem",
    ),
    "sensors are nowhere": ({"sensors: rtk_good": "sensors: rtk_godo"}, "rtk_good"),
    "robot has a NUL in its name": ({"robot: segway_e1": 'robot: "segway\\0e1.yaml"'}, "robot"),
    "carries a sensor twice over": ({"[lidar, gps]": "[radar]"}, "radar"),
    "title is a mapping": ({'title: "Tuned': 'title: {a: 1} # "'}, "title"),
}
SUITES: dict[str, tuple[Changes, str]] = {
    "stacks are none": ({"stacks: [nav2-gps, parked]": "stacks: []"}, "stacks"),
    "stacks are a text": ({"stacks: [nav2-gps, parked]": "stacks: nav2-gps"}, "stacks"),
    "stack is unknown": ({"nav2-gps, parked": "nav2-gsp"}, "nav2-gps"),
    "cells are a million": ({"seeds: [0, 1]": f"seeds: {list(range(1500))}"}, "cells"),
    "seed is negative": ({"seeds: [0, 1]": "seeds: [-1]"}, "seed"),
    "seed has 400 digits": ({"seeds: [0, 1]": f"seeds: [{_HUGE}]"}, "seed"),
    "episodes are none": ({"episodes: 5": "episodes: 0"}, "episodes"),
    "episodes have 400 digits": ({"episodes: 5": f"episodes: {_HUGE}"}, "episodes"),
    "people are too many": ({"pedestrians: [0, 20]": "pedestrians: [1000000000]"}, "pedestrians"),
    "map climbs": ({"maps: [sidewalk]": "maps: [../../../etc/passwd]"}, "passwd"),
    "a cell is there twice": ({"seeds: [0, 1]": "seeds: [0, 0]"}, "two cells"),
}
NAV2: dict[str, tuple[Changes, str]] = {  # each in a file of navbench run
    "costmap is a thousand kilometres": (
        {"width: 24": "width: 1000000", "height: 24": "height: 1000000"},
        "costmap",
    ),
    "costmap has cells of a hair's breadth": (
        {"resolution: 0.05": "resolution: 1.0e-9"},
        "costmap",
    ),
    "costmap has a resolution that is no number": (
        {"resolution: 0.05": "resolution: .nan"},
        "resolution",
    ),
    "costmap is updated without end": (
        {"update_frequency: 30.0": "update_frequency: 1.0e+9"},
        "frequency",
    ),
    "controller runs at no number": (
        {"controller_frequency: 30.0": "controller_frequency: .nan"},
        "frequency",
    ),
    "controller samples a billion velocities": (
        {"vx_samples: 20": "vx_samples: 1000000000"},
        "samples",
    ),
    "controller looks a year ahead": ({"sim_time: 1.0": "sim_time: 3.0e+7"}, "sim_time"),
    "controller looks in steps of a nanosecond": (
        {"linear_granularity: 0.05": "linear_granularity: 1.0e-12"},
        "granularities",
    ),
    "inflation reaches a thousand kilometres": (
        {"inflation_radius: 1.5": "inflation_radius: 1.0e+6"},
        "inflation_radius",
    ),
    "inflation falls by no number": (
        {"cost_scaling_factor: 3.0": "cost_scaling_factor: .nan"},
        "cost_scaling_factor",
    ),
    "plugin is unknown": (
        {"dwb_core::DWBLocalPlanner": "dwb_core::DWBLocalPlaner"},
        "DWBLocalPlanner",
    ),
}
# what is wrong with a keepout mask: yaml_filename, what must be said
MASKS: dict[str, tuple[str, str]] = {
    "climbs to a text": ("../../../../../../../../etc/passwd", "passwd"),
    "is a device": ("/dev/zero", "/dev/zero"),
    "is a folder": (".", "map"),
    "is a map of a device": ("mask.yaml", "/dev/zero"),
    "has a NUL in its name": ('"mask\\0.yaml"', "map"),
}
_SCENARIO = """\
title: "The robot drives."
drawing: {letter: 0.5, rows: "........................................"}
start: {x: 2.0, y: 0.25, yaw: 0.0}
goal: {x: 18.0, y: 0.25, yaw: 0.0}
people: [{waypoints: [[9.0, 0.25]]}]
things: [{box: [9.0, 0.0, 9.5, 0.5]}]
checks: {no_collision: true}
"""
SCENARIOS: dict[str, tuple[Changes, str]] = {
    "title is no sentence": ({"drives.": "drives"}, "title"),
    "title is a list": ({'"The robot drives."': "[a]"}, "title"),
    "nothing is checked": ({"{no_collision: true}": "{}"}, "checks"),
    "a check is unknown": ({"no_collision: true": "no_colision: true"}, "no_collision"),
    "a check is of another kind": (
        {"no_collision: true": "arrives_within: soon"},
        "arrives_within",
    ),
    "there is neither map nor drawing": ({"drawing:": "# drawing:"}, "drawing"),
    "there are map and drawing": ({"start:": "map: sidewalk\nstart:"}, "drawing"),
    "map climbs to a text": ({"drawing:": "map: ../../../../etc/passwd\n# "}, "passwd"),
    "map is a device": ({"drawing:": "map: /dev/zero\n# "}, "/dev/zero"),
    "letter is unknown": ({'rows: ".': 'rows: "?'}, "letter"),
    "letter is a kilometre": ({"letter: 0.5": "letter: 1000.0"}, "too large"),
    "letter is a hair's breadth": ({"letter: 0.5": "letter: 1.0e-9"}, "letter"),
    "letter is no number": ({"letter: 0.5": "letter: .nan"}, "letter"),
    "rows are of different lengths": ({'rows: ".': 'rows: "...\\n.'}, "length"),
    "rows are none": ({"........................................": ""}, "rows"),
    "start is no number": ({"x: 2.0": "x: .nan"}, "start"),
    "start is off the place": ({"x: 2.0": "x: -200.0"}, "start"),
    "start is astronomic": ({"x: 2.0": "x: 1.0e+300"}, "start"),
    "start is at the goal": ({"x: 2.0": "x: 17.0"}, "apart"),
    "goal is a list": ({"goal: {x: 18.0, y: 0.25, yaw: 0.0}": "goal: [18, 0]"}, "goal"),
    "somebody goes nowhere": ({"[[9.0, 0.25]]": "[]"}, "waypoints"),
    "somebody goes to no place": ({"[[9.0, 0.25]]": "[[.inf, 0.0]]"}, "waypoints"),
    "somebody stands at one number": ({"[[9.0, 0.25]]": "[[9.0]]"}, "waypoints"),
    "somebody is as fast as light": ({"[[9.0, 0.25]]": "[[9.0, 0.25]], speed: 3.0e+8"}, "speed"),
    "a thing is inside out": ({"[9.0, 0.0, 9.5, 0.5]": "[9.5, 0.0, 9.0, 0.5]"}, "box"),
    "a thing has a flat box": ({"[9.0, 0.0, 9.5, 0.5]": "[9.0, 0.0]"}, "box"),
    "people are a thousand": (
        {"[{waypoints: [[9.0, 0.25]]}]": f"[{'{waypoints: [[9.0, 0.25]]}, ' * 1000}]"},
        "at most",
    ),
    "time is endless": ({"checks:": "time_limit: .inf\nchecks:"}, "time_limit"),
    "time is a year": ({"checks:": "time_limit: 3.0e+7\nchecks:"}, "time_limit"),
    "stack is unknown": ({"checks:": "stack: nav2-gsp\nchecks:"}, "nav2-gps"),
    "stack is parked": ({"checks:": "stack: parked\nchecks:"}, "parked"),
    "world is unknown": ({"checks:": "world: esay\nchecks:"}, "easy"),
    "expectation is unknown": ({"checks:": "expect: maybe\nchecks:"}, "maybe"),
    "failure has no reason": ({"checks:": "expect: known_to_fail\nchecks:"}, "reason"),
    "seed is negative": ({"checks:": "seed: -1\nchecks:"}, "seed"),
}
_KEEPOUT = """
costmap_filter_info_server:
  ros__parameters: {{type: 0, filter_info_topic: keepout_costmap_filter_info, mask_topic: mask}}
filter_mask_server:
  ros__parameters: {{topic_name: mask, yaml_filename: {}}}
"""


def cases() -> Iterator[Case]:
    """Wrong values in every kind of file."""
    for kind, (folder, name, option, table) in OPTIONS.items():
        for what, (changes, says) in table.items():
            yield Case(
                f"{kind}: {what}",
                says,
                _with_option(option, changed(shipped_text(folder, name), changes)),
            )
    for what, (changes, says) in SENSORS.items():
        yield Case(
            f"sensors: {what}",
            says,
            _with_sensors(changed(shipped_text("sensors", "white_noise"), changes)),
        )
    for what, (changes, says) in STACKS.items():
        yield Case(
            f"stack: {what}",
            says,
            _with_stack(changed(shipped_text("stacks", "nav2-gps"), changes)),
        )
    for what, (changes, says) in SUITES.items():
        yield Case(
            f"suite: {what}", says, _with_suite(changed(shipped_text("suites", "example"), changes))
        )
    for what, (changes, says) in NAV2.items():
        yield Case(
            f"Nav2 file: {what}", says, _with_stack(changed(shipped_text("nav2", "tuned"), changes))
        )
    for what, (changes, says) in SCENARIOS.items():
        yield Case(f"scenario: {what}", says, _with_scenario(changed(_SCENARIO, changes)))
    for what, (mask, says) in MASKS.items():
        yield Case(f"mask: {what}", says, _with_mask(mask))
    yield Case("map show: picture cannot be written", "nowhere", _picture_nowhere)
    yield Case(
        "map new: name climbs out of the folder",
        "../evil",
        lambda _: ["map", "new", "--name", "../evil"],
    )


def _with_option(option: str, text: str) -> Make:
    people = () if option == "--world" else ("--pedestrians", "0")  # a world's own number counts
    return lambda folder: run_arguments(
        folder, option, str(put(folder / "given.yaml", text)), pedestrians=people
    )


def _with_stack(text: str) -> Make:
    return lambda folder: run_arguments(folder, stack=str(put(folder / "given.yaml", text)))


def _with_sensors(text: str) -> Make:
    def make(folder: Path) -> list[str]:
        sensors = put(folder / "given.yaml", text)
        stack = put(
            folder / "mine.yaml",
            shipped_text("stacks", "nav2-gps").replace("rtk_good", str(sensors)),
        )
        return run_arguments(folder, stack=str(stack))

    return make


def _with_suite(text: str) -> Make:
    return lambda folder: [
        "suite",
        str(put(folder / "given.yaml", text)),
        "--out",
        str(folder / "out"),
    ]


def _with_scenario(text: str) -> Make:
    return lambda folder: ["scenario", str(put(folder / "given.yaml", text))]


def _with_mask(name: str) -> Make:
    def make(folder: Path) -> list[str]:
        put(folder / "mask.yaml", MAP_TEXT.replace("map.pgm", "/dev/zero"))
        text = shipped_text("nav2", "tuned") + _KEEPOUT.format(name)
        return run_arguments(folder, stack=str(put(folder / "given.yaml", text)))

    return make


def _picture_nowhere(folder: Path) -> list[str]:
    return ["map", "show", str(write_map(folder)), "--out", str(folder / "nowhere" / "map.png")]
