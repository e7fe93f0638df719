"""Call the program in this process, as a user does by its command."""

import pytest

from navbench.cli.app import main


def status(*arguments: str) -> int:
    """Its exit status."""
    with pytest.raises(SystemExit) as leaving:
        main(list(arguments))
    return int(leaving.value.code or 0)


def navbench(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Its exit status, standard output and standard error."""
    code = status(*arguments)
    told = capsys.readouterr()
    return code, told.out, told.err
