"""Rules about model predictive path integral control (MPPI)."""

import math
from collections.abc import Iterator

from navstack.params.lint.rule import Finding, RuleGroup, above, decimal, whole_above
from navstack.params.lint.subject import CONTROLLER, MPPI, Subject

UNEQUAL = 1.1  # ratio of the accelerations' limits from which on they count as unequal
RARELY_MET = 2.0  # a limit of so many standard deviations of the noise is met rarely

RULES = RuleGroup("MPPI")


@RULES.warning
def mppi_capped_speed(subject: Subject) -> Iterator[Finding]:
    """MPPI's vx_std is too small for vx_max.

    Why: the control cost outweighs what PathFollowCritic gains: the robot never gets near vx_max, whatever it says.
    """
    if subject.mppi is None:
        return
    name, params = subject.mppi
    follow = params.PathFollowCritic
    if "PathFollowCritic" not in params.critics or not follow.enabled or follow.cost_power > 1:
        return
    gain = follow.cost_weight * params.model_dt
    if gain == 0.0 or params.gamma == 0.0:
        return
    speed = gain * params.vx_std * params.vx_std / params.gamma
    if speed < 0.99 * params.vx_max:
        yield Finding(
            CONTROLLER,
            f"{name}.vx_std",
            f"PathFollowCritic.cost_weight {follow.cost_weight:g} x model_dt {params.model_dt:g} s x vx_std^2 / gamma "
            f"{params.gamma:g} = {speed:.2g} m/s, but vx_max is {params.vx_max:g} m/s",
            f"vx_std: {above(math.sqrt(params.vx_max * params.gamma / gain), 2)}",
        )


@RULES.warning
def mppi_biased_noise(subject: Subject) -> Iterator[Finding]:
    """MPPI may brake harder than speed up, or the other way round.

    Why: each sample changes by no more per step, which pulls the samples towards the larger limit: the robot creeps or
    hurries.
    """
    if subject.mppi is None:
        return
    name, params = subject.mppi
    weaker, stronger = sorted((params.ax_max, abs(params.ax_min)))
    if stronger > UNEQUAL * weaker and weaker * params.model_dt < RARELY_MET * params.vx_std:
        yield Finding(
            CONTROLLER,
            f"{name}.ax_min",
            f"{params.ax_min:g} m/s2, but ax_max is {params.ax_max:g} m/s2",
            f"ax_min: {decimal(-params.ax_max)}; the velocity smoother may limit further",
        )


@RULES.warning
def mppi_outruns_window(subject: Subject) -> Iterator[Finding]:
    """MPPI's horizon reaches beyond the local costmap.

    Why: the far end of every trajectory counts as unknown space, and obstacles there are not seen.
    """
    drive = subject.drive
    if drive is None or drive.type != MPPI or subject.local is None:
        return
    steps, period = (subject.number(CONTROLLER, f"{drive.name}.{key}", value) for key, value in
                     (("time_steps", 56.0), ("model_dt", 0.05)))  # fmt: skip
    reach, half = subject.top_speed * steps * period, subject.local.half_window
    if subject.local.params.rolling_window and reach > half:
        yield Finding(
            CONTROLLER,
            f"{drive.name}.time_steps",
            f"{subject.top_speed:g} m/s x {steps:g} x {period:g} s = {reach:.2f} m, but the local costmap ends "
            f"{half:g} m from the robot",
            f"local_costmap width and height: {whole_above(2.2 * reach)}, or time_steps: "
            f"{whole_above(half / (subject.top_speed * period) - 1.0)}",
        )


@RULES.error
def mppi_steps_too_short(subject: Subject) -> Iterator[Finding]:
    """MPPI's model_dt is shorter than a control period.

    Why: Nav2 refuses to configure the controller.
    """
    drive = subject.drive
    if drive is None or drive.type != MPPI or subject.server is None:
        return
    period = subject.number(CONTROLLER, f"{drive.name}.model_dt", 0.05)
    needed = 1.0 / subject.server.controller_frequency
    if period < needed - 1e-9:
        yield Finding(
            CONTROLLER,
            f"{drive.name}.model_dt",
            f"{period:g} s, but a control period is {needed:g} s",
            f"model_dt: {decimal(needed)}",
        )


@RULES.warning
def mppi_no_such_layer(subject: Subject) -> Iterator[Finding]:
    """A critic of MPPI names an inflation layer that the local costmap does not have.

    Why: costs then tell no distances: CostCritic walks along the outline of every pose, and ObstaclesCritic misjudges
    them.
    """
    if subject.mppi is None or subject.local is None:
        return
    name, params = subject.mppi
    layers = list(subject.local.inflations)
    for critic in ("CostCritic", "ObstaclesCritic"):
        layer = getattr(params, critic).inflation_layer_name
        if critic in params.critics and getattr(params, critic).enabled and layer and layer not in layers:
            yield Finding(
                CONTROLLER,
                f"{name}.{critic}.inflation_layer_name",
                f"'{layer}', but the inflation layers of local_costmap are: {', '.join(layers) or 'none'}",
                f'inflation_layer_name: "{layers[-1]}"' if layers else "an inflation layer in local_costmap's plugins",
            )
