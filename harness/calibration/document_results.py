"""The parts of the document about the frozen world."""

from collections.abc import Mapping

from harness.calibration.attempts import share_distance
from harness.calibration.reading import INJURY, METHODS, STANDING, Reading
from harness.calibration.verification import LEVEL, Prediction, count_tests, predictions, share_tests
from harness.report.markdown import interval_text, number_text, p_text, table
from harness.report.published import Published
from harness.statistics import Interval, wilson_interval
from harness.valuation import OUTCOMES

DECIMALS = {"avg_distance_km": 4, "avg_runtime_h": 4, "avg_collision_impulse_ns": 1}
NAMES = {
    INJURY: "pedestrian injury cost",
    "avg_collision_impulse_ns": "total impulse",
    "avg_distance_km": "distance",
    "avg_runtime_h": "run time",
    "avg_velocity_mps": "speed",
}


def shortfalls(readings: Mapping[str, Reading], published: Published) -> tuple[int, list[str], int, list[str]]:
    """How many shares were tested, which are rejected, how many predictions have a gate, and which miss it."""
    tests, counts = share_tests(readings, published), count_tests(readings, published)
    rejected = [
        f"{test.stack}: {test.outcome} {test.ours.value:.3f} against {test.theirs / test.theirs_n:.2f} published "
        f"(p = {p_text(test.p_holm)} after Holm)"
        for test in tests
        if test.is_rejected
    ]
    gated = [each for each in predictions(readings, published) if each.holds is not None]
    missed = [
        f"{each.stack}: {_name(each)} {number_text(each.ours.value, _decimals(each))} against {each.theirs:g} "
        f"{each.unit} published"
        for each in gated
        if not each.holds
    ]
    missed += [
        f"{each.stack}: {each.ours} contacts with property in {each.ours_n} deliveries against {each.theirs} in "
        f"{each.theirs_n} published (p = {p_text(each.p)})"
        for each in counts
        if each.is_rejected
    ]
    return len(tests), rejected, len(gated) + len(counts), missed


def verification_section(readings: Mapping[str, Reading], published: Published, revenue: float) -> str:
    """Outcome shares, predictions, property and standing of the frozen world."""
    if not readings:
        return "## Verification\n\nNot done yet: freeze a world, then `python benchmarks/calibrate.py verify`.\n"
    driven = ", ".join(f"{stack} {reading.n}" for stack, reading in readings.items())
    seeds = ", ".join(sorted({str(reading.seed) for reading in readings.values()}))
    errors = sum(reading.errors for reading in readings.values())
    failed = f"; {errors} deliveries ended in an error and are left out" if errors else ""
    parts = [
        f"## Verification\n\nThe frozen world, driven once (seed {seeds}; deliveries: {driven}{failed}). "
        "Runs: `results/baseline/`.",
        f"### Outcome shares\n\nFisher's exact test, two-sided; Holm over all rows; rejected below {LEVEL:g}. Ours "
        f"with Wilson's 95 % interval.\n\n{_share_table(readings, published)}",
        f"### Predicted, not fitted\n\n{_prediction_table(readings, published)}",
        "Published seconds are wall time of a throttled simulation, so run time and speed have no gate.",
        f"### Contacts with property\n\nCounted contacts with mailboxes, trash bins, building glass and bollards; "
        f"exact test of two Poisson rates.\n\n{_count_table(readings, published)}",
        _standing(readings, published, revenue),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def elsewhere_section(elsewhere: Mapping[str, Mapping[str, Reading]]) -> str:
    """The frozen world under other conditions: reported, not tuned."""
    if not elsewhere:
        return ""
    rows = [
        [
            condition,
            stack,
            str(reading.n),
            *(interval_text(wilson_interval(reading.counts[name], reading.n), 2) for name in OUTCOMES),
            interval_text(reading.means[INJURY], 2),
            interval_text(reading.margin, 2),
        ]
        for condition, readings in elsewhere.items()
        for stack, reading in readings.items()
    ]
    heading = ["where", "stack", "n", "SLA", "spoiled", "timeout", "assistance", "injuries [USD]", "margin [USD]"]
    introduction = "The same parameters on other maps and with other people: reported, not tuned."
    return f"## Elsewhere\n\n{introduction}\n\n{table(heading, rows)}\n"


def _share_table(readings: Mapping[str, Reading], published: Published) -> str:
    rows = [
        [
            test.stack,
            test.outcome,
            f"{interval_text(test.ours, 3)} (n = {test.ours.n})",
            f"{test.theirs / test.theirs_n:.2f} (n = {test.theirs_n})",
            p_text(test.p),
            p_text(test.p_holm),
            "**rejected**" if test.is_rejected else "not rejected",
        ]
        for test in share_tests(readings, published)
    ]
    distance = number_text(share_distance(readings, published), 3)
    heading = ["stack", "outcome", "ours", "published", "p", "p (Holm)", ""]
    return f"{table(heading, rows)}\n\nMean absolute difference of the shares: {distance}."


def _prediction_table(readings: Mapping[str, Reading], published: Published) -> str:
    verdicts = {None: "reported", True: "within", False: "**missed**"}
    rows = [
        [
            each.stack,
            _name(each),
            each.unit,
            interval_text(each.ours, _decimals(each)),
            f"{each.theirs:.{_decimals(each)}f}",
            number_text(each.ratio, 2),
            "--" if each.gate is None else f"{each.gate[0]:.2f} to {each.gate[1]:.2f}",
            verdicts[each.holds],
        ]
        for each in predictions(readings, published)
    ]
    return table(["stack", "quantity", "unit", "ours", "published", "ratio", "allowed", ""], rows)


def _count_table(readings: Mapping[str, Reading], published: Published) -> str:
    rows = [
        [
            each.stack,
            f"{each.ours} in {each.ours_n}",
            f"{each.theirs} in {each.theirs_n}",
            p_text(each.p),
            "**rejected**" if each.is_rejected else "not rejected",
        ]
        for each in count_tests(readings, published)
    ]
    return table(["stack", "ours", "published", "p", ""], rows)


def _standing(readings: Mapping[str, Reading], published: Published, revenue: float) -> str:
    """What standing still costs: the floor of every controller that only takes care."""
    if STANDING[0] not in readings:
        return ""
    rate = readings[STANDING[0]].injury_per_second
    if not rate.value:
        return "### The floor\n\nNobody was hurt by walking into the parked robot.\n"
    still = published.methods[STANDING[1]]
    lines = [
        f"### The floor\n\nWho stands still is walked into: {interval_text(_per_minute(rate), 2)} USD per minute here "
        f"(published, {still.title} at {still.measured.avg_velocity_mps:g} m/s: "
        f"{still.measured.pedestrian_injury_usd_per_run / still.measured.avg_runtime_h / 60.0:.2f}). A delivery earns "
        f"at most {revenue:.2f} USD, which standing uses up in {revenue / rate.value:.0f} s."
    ]
    for stack in METHODS:
        if stack in readings:
            seconds = 3600.0 * (readings[stack].means["avg_runtime_h"].value or 0.0)
            verdict = "more than" if rate.value * seconds > revenue else "not more than"
            lines.append(
                f"Standing as long as {stack} drives ({seconds:.0f} s) costs {rate.value * seconds:.2f} USD, {verdict} "
                f"a delivery can earn; {stack} itself pays {number_text(readings[stack].means[INJURY].value, 2)} USD."
            )
    lines.append(
        "This is the floor for who only stops for people: below it is who gets out of their way, or is sooner there."
    )
    return "\n".join(lines)


def _per_minute(rate: Interval) -> Interval:
    value, low, high = (None if end is None else 60.0 * end for end in (rate.value, rate.low, rate.high))
    return Interval(value, low, high, rate.n)


def _decimals(each: Prediction) -> int:
    return DECIMALS.get(each.quantity, 2)


def _name(each: Prediction) -> str:
    return NAMES.get(each.quantity, each.quantity)
