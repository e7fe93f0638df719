"""The options of the scripts in this folder."""

import argparse


def parsed(
    usage: str | None,
    parser: argparse.ArgumentParser | None = None,
    **defaults: object,
) -> argparse.Namespace:
    """What a user gave.

    Args:
        usage: printed with --help: the script's docstring.
        parser: with what the script takes beside these options.
        defaults: of each option, which is of the same type; a list takes one or more values.
    """
    parser = parser or argparse.ArgumentParser()
    parser.description, parser.formatter_class = usage, argparse.RawDescriptionHelpFormatter
    for name, default in defaults.items():
        is_list = isinstance(default, list)
        kind = type(default[0] if is_list else default)
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=kind,
            default=default,
            nargs="+" if is_list else None,
        )
    return parser.parse_args()
