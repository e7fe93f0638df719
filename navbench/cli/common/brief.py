"""A command whose help shows the options that most need; ``--help-all`` shows all."""

from collections.abc import Collection
from typing import Any

import click

from harness.storage.texts import quoted


class Brief(click.Command):
    """A command that shows some of its options in its help.

    Args:
        shown: names of the parameters that ``--help`` shows; ``--help-all`` shows every one.
        given: as of :class:`click.Command`.
    """

    def __init__(self, *given: Any, shown: Collection[str], **more: Any) -> None:
        super().__init__(*given, **more)
        self._shown = frozenset(shown)
        self.params.append(
            click.Option(
                ["--help-all"],
                is_flag=True,
                expose_value=False,
                is_eager=True,
                callback=self._show_all,
                help="Show every option and leave.",
            )
        )

    def _show_all(self, context: click.Context, _: click.Parameter, is_asked: bool) -> None:
        if is_asked and not context.resilient_parsing:
            self._shown = frozenset(str(parameter.name) for parameter in self.params)
            click.echo(self.get_help(context), color=context.color)
            context.exit()

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options that are shown."""
        always = ("help", "help_all")
        records = []
        for parameter in self.get_params(ctx):
            if parameter.name not in (*self._shown, *always):
                continue
            record = parameter.get_help_record(ctx)
            if record is not None:
                records.append(record)
        with formatter.section("Options"):
            formatter.write_dl(records)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As of click; a name that stands where none is taken is taken for a stack's."""
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            if type(error) is click.UsageError and "unexpected extra argument" in error.message:
                extra = error.message.partition("(")[2].rstrip(")").split()[0]
                hint = f"'{extra}' belongs to no option; did you mean --stack {quoted(extra)}?"
                raise click.UsageError(hint, ctx) from None
            raise
