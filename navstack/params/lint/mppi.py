"""Rules about model predictive path integral control (MPPI)."""

import math
from collections.abc import Iterator

from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, decimal, whole_above
from navstack.params.lint.subject import CONTROLLER, MPPI, DrivingPlugin, Subject
from navstack.params.mppi import MppiParams

UNEQUAL = 1.1  # ratio of the accelerations' limits from which on they count as unequal
RARELY_MET = 2.0  # a limit of so many standard deviations of the noise is met rarely

RULES = RuleGroup("MPPI", CONTROLLER)


@RULES.warning
def mppi_capped_speed(mppi: MppiParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """MPPI's vx_std is too small for vx_max.

    Why: the control cost outweighs what PathFollowCritic gains: the robot never gets near vx_max,
    whatever it says.
    """
    follow = mppi.PathFollowCritic
    if "PathFollowCritic" not in mppi.critics or not follow.enabled or follow.cost_power > 1:
        return
    gain = follow.cost_weight * mppi.model_dt
    if gain == 0.0 or mppi.gamma == 0.0:
        return
    speed = gain * mppi.vx_std * mppi.vx_std / mppi.gamma
    if speed < 0.99 * mppi.vx_max:
        yield Finding(
            f"{drive.name}.vx_std",
            f"PathFollowCritic.cost_weight {follow.cost_weight:g} x model_dt {mppi.model_dt:g} s x "
            f"vx_std^2 / gamma {mppi.gamma:g} = {speed:.2g} m/s, but vx_max is {mppi.vx_max:g} m/s",
            f"vx_std: {above(math.sqrt(mppi.vx_max * mppi.gamma / gain), 2)}",
        )


@RULES.warning
def mppi_crossed_speeds(mppi: MppiParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """MPPI's vx_min is not below vx_max.

    Why: every speed is limited to vx_max: the robot can neither slow down nor stop.
    """
    if mppi.vx_min >= mppi.vx_max:
        yield Finding(
            f"{drive.name}.vx_min",
            f"{mppi.vx_min:g} m/s is not below vx_max, {mppi.vx_max:g} m/s",
            "vx_min: 0.0, or below 0 to drive backwards",
        )


@RULES.warning
def mppi_biased_noise(mppi: MppiParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """MPPI may brake harder than speed up, or the other way round.

    Why: each sample changes by no more per step, which pulls the samples towards the larger limit:
    the robot creeps or hurries.
    """
    weaker, stronger = sorted((mppi.ax_max, abs(mppi.ax_min)))
    if stronger > UNEQUAL * weaker and weaker * mppi.model_dt < RARELY_MET * mppi.vx_std:
        yield Finding(
            f"{drive.name}.ax_min",
            f"{mppi.ax_min:g} m/s2, but ax_max is {mppi.ax_max:g} m/s2",
            f"ax_min: {decimal(-mppi.ax_max)}; the velocity smoother may limit further",
        )


@RULES.warning
def mppi_outruns_window(
    subject: Subject, drive: DrivingPlugin, local: CostmapView, top_speed: float
) -> Iterator[Finding]:
    """MPPI's horizon reaches beyond the local costmap.

    Why: the far end of every trajectory counts as unknown space, and obstacles there are not seen.
    """
    if drive.type != MPPI:
        return
    steps = subject.number(CONTROLLER, f"{drive.name}.time_steps", 56.0)
    period = subject.number(CONTROLLER, f"{drive.name}.model_dt", 0.05)
    reach, half = top_speed * steps * period, local.half_window
    if local.params.rolling_window and reach > half:
        yield Finding(
            f"{drive.name}.time_steps",
            f"{top_speed:g} m/s x {steps:g} x {period:g} s = {reach:.2f} m, "
            f"but the local costmap ends {half:g} m from the robot",
            f"local_costmap width and height: {whole_above(2.2 * reach)}, or time_steps: "
            f"{whole_above(half / (top_speed * period) - 1.0)}",
        )


@RULES.warning
def mppi_no_such_layer(
    mppi: MppiParams, local: CostmapView, drive: DrivingPlugin
) -> Iterator[Finding]:
    """A critic of MPPI names an inflation layer that the local costmap does not have.

    Why: costs then tell no distances: CostCritic walks along the outline of every pose, and
    ObstaclesCritic misjudges them.
    """
    layers = list(local.inflations)
    known, advice = "none", "an inflation layer in local_costmap's plugins"
    if layers:
        known, advice = ", ".join(layers), f'inflation_layer_name: "{layers[-1]}"'
    for critic in ("CostCritic", "ObstaclesCritic"):
        params = getattr(mppi, critic)
        layer = params.inflation_layer_name
        if critic in mppi.critics and params.enabled and layer and layer not in layers:
            yield Finding(
                f"{drive.name}.{critic}.inflation_layer_name",
                f"'{layer}', but the inflation layers of local_costmap are: {known}",
                advice,
            )
