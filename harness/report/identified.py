"""What was identified of a robot, as blocks."""

from collections.abc import Sequence

from harness.identify.estimate import Estimate
from harness.identify.identification import Identified
from harness.identify.prediction import PredictionError
from harness.identify.robot_file import Written
from harness.recorded.drive_log import DriveLog
from harness.report.blocks import Block, Table, Text
from harness.report.numbers import number_text

MAIN = (  # that the screen shows; --full shows all
    "dead_time_s",
    "lag_s",
    "linear_max_acceleration_mps2",
    "linear_max_deceleration_mps2",
    "angular_max_acceleration_radps2",
    "odometry_linear_scale",
    "odometry_angular_scale",
    "imu_yaw_rate_bias_radps",
    "gps_position_std_m",
    "lidar_noise_std_m",
    "lidar_x_m",
    "lidar_yaw_rad",
)
_MOST_MISSING = 3  # lines of what is not identifiable


def identified_blocks(
    found: Identified,
    log: DriveLog,
    written: Written,
    is_full: bool,
) -> list[Block]:
    """The screen of ``navbench identify``.

    Args:
        found: what was identified.
        log: the drive.
        written: the files that were made.
        is_full: whether to show every value.
    """
    known = [each for each in found.estimates.values() if each.is_known]
    missing = [each for each in found.estimates.values() if not each.is_known]
    first = (
        f"{log.files}: {log.duration:.0f} s of driving; {len(known)} of {len(found.estimates)} "
        f"values identified, {written.measured} of {written.total} in the files measured"
    )
    shown = known
    if not is_full:
        shown = [each for each in known if each.key in MAIN]
    headers = ("value", "found", "95 % interval", "seconds")
    blocks: list[Block] = [Text(first, "whole")]
    if shown:
        blocks.append(Table("", headers, [_row(each) for each in shown]))
    blocks += [Text(line, "whole") for line in _missing(missing, is_full)]
    blocks += [Text(_prediction(each, found.predicts), "whole") for each in found.predictions]
    if not found.predictions:
        blocks.append(Text(f"no prediction was tried: {found.predicts}", "whole"))
    blocks += [Text(note, "whole") for note in written.notes]
    command = f"navbench run --stack FILE --robot {written.robot} --sensors {written.sensors}"
    return [*blocks, Text(f"next: {command}", "whole")]


def _row(estimate: Estimate) -> tuple[str, ...]:
    ends = [number_text(end, None) for end in (estimate.low, estimate.high)]
    interval = f"[{ends[0]}, {ends[1]}]"
    return estimate.key, number_text(estimate.value, 4), interval, f"{estimate.seconds:.0f}"


def _missing(missing: Sequence[Estimate], is_full: bool) -> list[str]:
    """Values that are not identifiable, by what to drive."""
    by_advice: dict[str, list[str]] = {}
    for each in missing:
        by_advice.setdefault(each.advice, []).append(each.key)
    lines = []
    for advice, keys in sorted(by_advice.items(), key=lambda item: -len(item[1])):
        names = ", ".join(keys)
        if len(keys) > 3 and not is_full:
            names = f"{', '.join(keys[:2])} and {len(keys) - 2} more"
        lines.append(f"not identifiable from this bag: {names}: {advice}")
    if is_full or len(lines) <= _MOST_MISSING:
        return lines
    more = len(lines) - _MOST_MISSING
    return [*lines[:_MOST_MISSING], f"{more} more such lines with --full"]


def _prediction(error: PredictionError, what: str) -> str:
    return (
        f"{error.horizon_s:.3g} s ahead on the unused half ({what}), against {error.against}: off "
        f"by {error.identified_m:.3g} m; default robot {error.default_m:.3g} m (better by "
        f"{error.gain_m:.2g} [{error.gain_low_m:.2g}, {error.gain_high_m:.2g}]), constant twist "
        f"{error.constant_twist_m:.3g} m (RMS, n {error.n})"
    )
