"""``docs/calibration.md``: written from what is kept, so that whoever has the files can make it again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.calibration.attempts import Attempt
from harness.calibration.declaration import Declaration, value_text
from harness.calibration.document_results import elsewhere_section, shortfalls, verification_section
from harness.calibration.reading import INJURY, METHODS, STANDING, Reading
from harness.calibration.sensitivities import COMPARED, Effect, Study, ranked
from harness.report.markdown import interval_text, number_text, p_text, table, wrapped
from harness.report.published import Published
from harness.statistics import Interval

TITLES = {  # key of what is compared -> heading and decimals
    "sla": ("SLA", 3),
    "spoiled": ("spoiled", 3),
    "timeout": ("timeout", 3),
    "physical_assistance": ("assistance", 3),
    INJURY: ("injuries [USD]", 2),
    "avg_collision_impulse_ns": ("impulse [N s]", 1),
    "avg_distance_km": ("distance [km]", 4),
    "contribution_margin": ("margin [USD]", 2),
}

INTRODUCTION = """\
# Calibration

Do the published Nav2 rows come out of our world with the published settings? Here is every parameter that they rest
on, how much each one that is not published matters, every attempt to come nearer, and how the frozen world compares.
Made by `python benchmarks/calibrate.py document` from `params/calibration/costnav.yaml`,
`params/published/costnav.yaml` and `results/baseline/`.

The rules:

- Free is only what is not published and has a physical meaning, within a range that can be defended without looking at
  the results. Nothing belongs to one method or one outcome. Contact threshold, timeout, arrival radius, spoilage share,
  Nav2's parameters and prices are fixed.
- Attempts drive seed 1000, and all are logged (`calibrate.py attempt`). Values out of range are refused; where runs
  that were driven already are logged, such values are marked, and any seed but 0 is taken.
- The frozen world, `params/worlds/published.yaml`, drives seed 0 once (`calibrate.py verify`). `make frozen` drives
  what of this page, of the [four controllers](controllers.md) and of the [tuned file](tuning.md#results) is not in
  `results/baseline/`; the rest of the [published study](study.md) is `python benchmarks/published_study.py`'s.
- The maps are ours, generated after the published map's statistics ([what is simplified](simplifications.md)).
"""


@dataclass(frozen=True, slots=True)
class Material:
    """All that the document tells of."""

    declaration: Declaration
    published: Published
    attempts: Sequence[Attempt]
    study: Study | None  # sensitivities; None: not measured
    readings: Mapping[str, Reading]  # of the frozen world, by stack; empty: not frozen yet
    elsewhere: Mapping[str, Mapping[str, Reading]]  # condition -> stack -> the frozen world under it
    revenue: float  # [USD/run] at most
    notes: str  # written by hand: what follows from it all


def document(material: Material) -> str:
    """The whole document."""
    parts = [
        INTRODUCTION,
        _in_short(material),
        _free_section(material),
        _sensitivity_section(material.study),
        _attempts_section(material.attempts),
        verification_section(material.readings, material.published, material.revenue),
        elsewhere_section(material.elsewhere),
        _shortfall_section(material),
        _fixed_section(material.declaration),
    ]
    return wrapped("\n".join(part.strip("\n") + "\n" for part in parts if part))


def _in_short(material: Material) -> str:
    lines = [
        f"{len(material.declaration.free)} parameters are free, {len(material.declaration.fixed)} fixed; "
        f"attempts: {len(material.attempts)}."
    ]
    if material.readings:
        tests, rejected, gates, missed = shortfalls(material.readings, material.published)
        lines.append(
            f"Of {tests} outcome shares {len(rejected)} are rejected at 5 % (Fisher, Holm); of {gates} predictions "
            f"with a gate {len(missed)} miss it."
        )
    else:
        lines.append("No world is frozen yet: there is no verification.")
    return "## In short\n\n" + "\n".join(lines)


def _free_section(material: Material) -> str:
    frozen = _frozen_settings(material.readings)
    heading = ["parameter", "shipped", *(["frozen"] if material.readings else []), "unit", "defensible", "why"]
    rows = [
        [
            f"`{key}`",
            value_text(free.value),
            *([value_text(frozen.get(key, free.value))] if material.readings else []),
            free.unit,
            free.allowed,
            free.reason,
        ]
        for key, free in material.declaration.free.items()
    ]
    text = f"## Free parameters\n\n{table(heading, rows)}\n"
    odd = {key: value for key, value in frozen.items() if key not in material.declaration.free}
    if odd:
        listed = ", ".join(f"`{key}` = {value_text(value)}" for key, value in odd.items())
        text += f"\nThe frozen world also differs in what is not free: {listed}.\n"
    return text


def _fixed_section(declaration: Declaration) -> str:
    fixed = table(
        ["parameter", "value", "source"],
        [[f"`{key}`", value_text(each.value), each.source] for key, each in declaration.fixed.items()],
    )
    constants = table(
        ["constant of the code", "value", "source"],
        [[f"`{key}`", value_text(each.value), each.source] for key, each in declaration.code.items()],
    )
    unused = table(["parameter", "why"], [[f"`{key}`", why] for key, why in declaration.unused.items()])
    return (
        f"## Fixed parameters\n\n{fixed}\n\n{constants}\n\nNothing published rests on these (a key stands for all "
        f"below it):\n\n{unused}\n"
    )


def _sensitivity_section(study: Study | None) -> str:
    title = "## How much each free parameter matters"
    if study is None:
        return f"{title}\n\nNot measured yet: `python benchmarks/calibrate.py sensitivity`.\n"
    parts = [
        f"{title}\n\nEach free parameter at the ends of its range, all others as shipped: difference per delivery from "
        f"the shipped world, paired by mission, with 95 % intervals (seed {study.seed}, {study.episodes} deliveries; "
        "`calibrate.py sensitivity`). Bold: p < 0.05 after Holm over all differences in these tables. `none`: no "
        "delivery differs, or none by more than a cent. The parameter that moves the outcome shares most comes first."
    ]
    for stack, present in study.present.items():
        effects = [effect for effect in study.effects if effect.stack == stack]
        parts.append(f"### {stack}\n\n{_effects_table(present, effects, study.sure)}")
    return "\n\n".join(parts) + "\n"


def _effects_table(
    present: Mapping[str, Interval], effects: Sequence[Effect], sure: set[tuple[str, str, str, str]]
) -> str:
    first = ["as shipped", "", *(interval_text(present[name], TITLES[name][1]) for name in COMPARED)]
    order = ranked(effects)
    rows = [
        [f"`{effect.key}`", value_text(effect.value), *(_difference(effect, name, sure) for name in COMPARED)]
        for effect in sorted(effects, key=lambda effect: order.index(effect.key))
    ]
    return table(["parameter", "value", *(TITLES[name][0] for name in COMPARED)], [first, *rows])


def _difference(effect: Effect, name: str, sure: set[tuple[str, str, str, str]]) -> str:
    interval = effect.differences[name]
    if interval.low is None and (interval.value is None or abs(interval.value) < 0.5 * 0.1 ** TITLES[name][1]):
        return "none"
    text = interval_text(interval, TITLES[name][1], is_signed=True)
    return f"**{text}**" if (effect.key, effect.end, effect.stack, name) in sure else text


def _attempts_section(attempts: Sequence[Attempt]) -> str:
    if not attempts:
        return "## Attempts\n\nNone was made: the shipped world is the first.\n"
    stacks = (*METHODS, STANDING[0])
    rows = [
        [
            str(number),
            each.name,
            _settings_text(each),
            *(_attempt_text(stack, each.stacks.get(stack)) for stack in stacks),
            number_text(each.share_distance, 3),
            p_text(each.least_p_holm),
        ]
        for number, each in enumerate(attempts, start=1)
    ]
    heading = ["", "name", "set", *stacks, "distance", "least p"]
    introduction = (
        f"The {len(attempts)} candidate worlds driven, in order. Per stack: n; shares of SLA, spoiled, timeout, "
        "assistance; injuries [USD], impulse [N s], distance [m] per delivery (parked: injuries in as long as NavDP "
        "stands). Distance: mean absolute difference of these shares from the published ones. Least p: of their Fisher "
        "tests, after Holm; with fewer deliveries than 400 little is rejected."
    )
    return f"## Attempts\n\n{introduction}\n\n{table(heading, rows)}\n"


def _settings_text(each: Attempt) -> str:
    listed = [
        f"`{key}` = {value_text(value)}{' (out of range)' if key in each.outside else ''}"
        for key, value in each.settings.items()
    ]
    return ", ".join(listed) or "as shipped"


def _attempt_text(stack: str, measured: Mapping[str, Any] | None) -> str:
    if measured is None:
        return "--"
    if stack == STANDING[0]:
        return f"{measured['n']}; {measured['injury_usd_while_navdp_stands']:.2f}"
    shares = " ".join(
        f"{measured[key] / measured['n']:.2f}" for key in ("sla", "spoiled", "timeout", "physical_assistance")
    )
    means = (
        f"{measured[INJURY]:.1f} {measured['avg_collision_impulse_ns']:.0f} {1000.0 * measured['avg_distance_km']:.0f}"
    )
    return f"{measured['n']}; {shares}; {means}"


def _shortfall_section(material: Material) -> str:
    if not material.readings and not material.notes:
        return ""
    lines = []
    if material.readings:
        _, rejected, _, missed = shortfalls(material.readings, material.published)
        lines = [f"- {line}" for line in (*rejected, *missed)] or ["- Nothing."]
    return "\n".join(["## What falls short", "", *lines, "", material.notes.strip()]) + "\n"


def _frozen_settings(readings: Mapping[str, Reading]) -> dict[str, Any]:
    return {key: value for reading in readings.values() for key, value in reading.settings.items()}
