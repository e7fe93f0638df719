"""Values of options that are more than a text or a number."""

import math
from collections.abc import Iterable
from typing import Any

import click

from navstack.errors import InputError


class Finite(click.FloatRange):
    """A number within limits; click's own range takes nan, which is within none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number, or click's complaint."""
        number = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is not a number.", param, ctx)
        return number


class Pose(click.ParamType[tuple[float, ...] | None]):
    """x [m], y [m], yaw [rad], as ``x,y,yaw``."""

    name = "pose"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The numbers.

        Raises:
            InputError: not three finite ones.
        """
        from harness.task.study import parse_pose

        assert param is not None
        return parse_pose(param.opts[0], value)


class Numbers(click.ParamType[tuple[float, ...]]):
    """Numbers between commas, as many as the option's metavar has."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The numbers; raises :class:`click.BadParameter` for anything else."""
        assert param is not None and param.metavar is not None
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != len(param.metavar.split(",")):
            raise click.BadParameter(f"{param.opts[0]} '{value}' is not {param.metavar}")
        return numbers


def settings_of(texts: Iterable[str]) -> dict[str, float]:
    """Values by key, of ``KEY=VALUE`` each.

    Raises:
        InputError: one is something else, or a key is given twice.
    """
    settings: dict[str, float] = {}
    for text in texts:
        key, _, number = (part.strip() for part in text.partition("="))
        if key in settings:
            raise InputError(f"--set {key} is given twice; give it once")
        try:
            settings[key] = float(number)
        except ValueError:
            raise InputError(
                f"--set '{text}' is not KEY=NUMBER, e.g. delivery_fee_usd_per_run=4.99"
            ) from None
    return settings


def pairs_of(texts: Iterable[str]) -> list[tuple[str, str]]:
    """Two prices of each text ``X,Y``.

    Raises:
        InputError: one is something else.
    """
    pairs = []
    for text in texts:
        x, _, y = (part.strip() for part in text.partition(","))
        if not x or not y:
            raise InputError(
                f"--map '{text}' is not two prices X,Y, e.g. delivery_fee,injury.costs"
            )
        pairs.append((x, y))
    return pairs


def names_of(texts: Iterable[str]) -> list[str]:
    """Every name in texts that hold one or several, separated by commas."""
    return [name.strip() for text in texts for name in text.split(",")]
