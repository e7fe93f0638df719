"""What commands print by default: the answer first, in few lines, and a command that works last."""

import io
import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest

from harness.execution.workers import Workers
from harness.report.blocks import Table, Text
from harness.report.tables import print_blocks, report_console
from harness.storage.shipped import shipped
from navbench.api.driving import Tally
from navbench.api.progress import say
from navbench.cli.app import COMMANDS, main
from navbench.cli.common.ending import print_with_notes
from tests.rules import short_rules

MOST_LINES = 25
MOST_OF_ALL = 40  # where somebody asks for all there is
MOST_OF_RUN = 12
RULES = short_rules(4.0)
STACKS = ("nav2-gps-ekf", "evasive-gps-ekf")
NEXT = re.compile(r"next: navbench (.*)")


def printed(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> list[str]:
    """The lines on standard output of a command."""
    with pytest.raises(SystemExit) as leaving:
        main(list(words))
    captured = capsys.readouterr()
    assert leaving.value.code == status, captured.err
    return captured.out.splitlines()


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_process: None) -> Iterator[Path]:
    """A folder to work in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(RULES, encoding="utf-8")
    yield tmp_path


@pytest.fixture
def run_words(place: Path, hall: Path) -> list[str]:
    """A run of two stacks among people, in a hall, cut short by its rules."""
    stacks = [word for stack in STACKS for word in ("--stack", stack)]
    where = ["--map", str(hall), "--rules", "short.yaml", "--pedestrians", "3"]
    return ["run", *stacks, *where, "--episodes", "2", "--workers", "1"]


def interrupt(*_: Any) -> NoReturn:
    raise KeyboardInterrupt


def follow(
    capsys: pytest.CaptureFixture[str], words: list[str], most: int = MOST_LINES
) -> list[str]:
    """Execute a command and every command that it and its followers lead to; all outputs' heads."""
    heads: list[str] = []
    seen: set[str] = set()
    while True:
        lines = printed(capsys, *words)
        assert 0 < len(lines) <= most, lines
        heads.append(lines[0])
        found = NEXT.search(lines[-1])
        if found is None or found[1] in seen:
            return heads
        seen.add(found[1])
        words, most = shlex.split(found[1]), MOST_LINES
        if "--all" in words:
            most = MOST_OF_ALL


@pytest.mark.slow
def test_each_next_command_works_as_printed(
    capsys: pytest.CaptureFixture[str], run_words: list[str], place: Path
) -> None:
    heads = follow(capsys, [*run_words, "--out", "one"], MOST_OF_RUN + 1)  # and what is unlike
    assert all(stack in heads[0] for stack in STACKS)
    assert "world" in heads[0] and "robot segway_e1" in heads[0] and "map hall" in heads[0]
    assert (place / "report.html").is_file()
    heads = follow(capsys, [*run_words, "--out", "two", "--page"], MOST_OF_RUN + 1)
    assert "evasive-gps-ekf" in heads[1] or "nav2-gps-ekf" in heads[1]
    assert (place / "two" / "report.html").is_file() and (place / "replay.html").is_file()
    for words in (
        ["price", "one"],
        ["compare", "one:nav2-gps-ekf", "one:evasive-gps-ekf"],
        ["explain", "one"],
        ["replay", "one", "--html", "again.html"],
        ["list", "stacks"],
    ):
        follow(capsys, words)


@pytest.mark.slow
def test_a_run_that_lost_nothing_has_an_answer_and_a_command_that_works(
    capsys: pytest.CaptureFixture[str],
    run_words: list[str],
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two stacks in an empty hall; what would decide is driven with fewer missions."""
    roomy = short_rules(241.0)
    (place / "short.yaml").write_text(roomy, encoding="utf-8")
    run_words[run_words.index("--pedestrians") + 1] = "0"
    words = [*run_words, "--page", "--out", "few"]
    monkeypatch.setattr(sys, "argv", ["navbench", *words])
    lines = printed(capsys, *words)
    assert len(lines) <= MOST_OF_RUN + 1
    (verdict,) = (line for line in lines if " earn the same on all 2 missions: 3.49 USD" in line)
    assert "the whole fee. Unseen losses leave a difference of up to " in verdict
    program, *command, number = shlex.split(lines[lines.index(verdict) + 1])
    assert f"; about {int(number):,d} missions without a loss would leave less than " in verdict
    assert f" USD, {int(number) - 2:,d} more:" in verdict
    assert [program, *command[:2], command[-1]] == ["navbench", "run", "--resume", "--episodes"]
    three = "".join(printed(capsys, *command, "3"))
    assert " earn the same on all 3 missions" in three and "(first looked at with 2)" in three
    page = (place / "few" / "report.html").read_text(encoding="utf-8")
    assert "(first looked at with 2)" in page, "the page is written anew"
    found = NEXT.search(lines[-1])
    assert found is not None and found[1] == "replay few"
    follow(capsys, ["replay", "few"])
    with pytest.raises(SystemExit):
        main(["explain", "few"])
    told_of = "note: nothing was lost in the delivery that earned least of 2 stacks: "
    assert told_of in capsys.readouterr().err


def test_rules_that_are_not_the_papers_are_named_beside_its_column(
    capsys: pytest.CaptureFixture[str], run_words: list[str], place: Path
) -> None:
    lines = printed(capsys, *run_words, "--out", "one")
    (unlike,) = (line for line in lines if line.startswith("not as in the paper: "))
    assert "rules costnav with timeout 4.0 (241.0)" in unlike
    assert "paper w/ GPS" in "".join(lines)
    full = printed(capsys, "run", "--resume", "one", "--full")
    assert any(line.startswith(unlike) for line in full) and len(full) > MOST_LINES
    printed(capsys, "report", "one", "--again", "0")
    assert "timeout 4.0 (241.0)" in (place / "report.html").read_text(encoding="utf-8")


def test_a_missing_argument_is_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["report"], ["lint"], ["price"], ["run", "--episodes"], ["run", "nav2-gps"]):
        with pytest.raises(SystemExit) as leaving:
            main(words)
        assert leaving.value.code == 2, words
    assert "did you mean --stack nav2-gps?" in capsys.readouterr().err


@pytest.mark.parametrize(("command", "most"), [("run", 17), ("tune", 15)])
def test_the_help_shows_few_options_and_help_all_shows_all(
    capsys: pytest.CaptureFixture[str], command: str, most: int
) -> None:
    short, whole = (
        "\n".join(printed(capsys, command, option)) for option in ("--help", "--help-all")
    )
    options = [set(re.findall(r"(?m)^  (?:-h, )?(--[\w-]+)", text)) for text in (short, whole)]
    assert len(options[0]) <= most < len(options[1])
    assert options[0] <= options[1] and "--executor" in options[1] - options[0]


def test_the_help_shows_the_commands_of_the_three_jobs_first(
    capsys: pytest.CaptureFixture[str],
) -> None:
    jobs = {"run", "lint", "check", "compare", "report", "explain", "tune", "ablate", "localize"}
    headings = list(COMMANDS)
    first = {name for heading in headings[:-2] for name in COMMANDS[heading]}
    doors = {"serve", "drive", "identify", "cost-log", "day"}  # to other programs and to fleets
    assert first == jobs | doors | {"list", "replay", "price"}
    assert headings[-2:] == ["Advanced", "For maintainers"]
    text = "\n".join(printed(capsys, "--help"))
    assert "sensitivity" not in text, "a former name is understood, and not shown"


@pytest.mark.parametrize("kind", ["stacks", "worlds", "robots", "sensors", "localizers", "spaces"])
def test_what_there_is_has_a_line_each(capsys: pytest.CaptureFixture[str], kind: str) -> None:
    lines = [line for line in printed(capsys, "list", kind) if not line.startswith("next: ")]
    assert all(re.fullmatch(r"\S+(?: \(default\))? +\S.*", line) for line in lines)
    if kind == "stacks":
        assert len(lines) == 8 < len(printed(capsys, "list", kind, "--all"))
    if kind == "worlds":
        assert sum("(default)" in line for line in lines) == 1


def test_a_shell_completes_commands() -> None:
    from click.shell_completion import ShellComplete

    from navbench.cli.app import app

    complete = ShellComplete(app, {}, "navbench", "_NAVBENCH_COMPLETE")
    assert {"run", "replay", "report"} <= {each.value for each in complete.get_completions([], "r")}
    options = {each.value for each in complete.get_completions(["run"], "--st")}
    assert {"--stack", "--start"} <= options
    stacks = {each.value for each in complete.get_completions(["run", "--stack"], "evasive")}
    kinds = ("gps-ekf", "amcl", "amcl-gps", "yielding-gps-ekf", "flow-gps-ekf")
    assert stacks == {f"evasive-{kind}" for kind in kinds}


@pytest.mark.slow
def test_what_a_tuning_leaves_open_its_next_command_decides(
    capsys: pytest.CaptureFixture[str],
    place: Path,
    hall: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    where = ["--map", str(hall), "--rules", "short.yaml", "--pedestrians", "3", "--workers", "1"]
    stock = str(shipped("params") / "nav2" / "stock.yaml")
    words = ["tune", "--stack", stock, "--localizer", "ground_truth", *where, "--out", "study"]
    words += ["--trials", "4", "--episodes", "2", "--objective", "+distance_m"]
    words += ["--finalists", "0", "--test-episodes", "0", "--waterfall", "0", "--seed", "1"]
    both = io.StringIO()
    with monkeypatch.context() as joined:
        joined.setattr(sys, "stdout", both)
        joined.setattr(sys, "stderr", both)
        with pytest.raises(SystemExit) as leaving:
            main(words)
    assert leaving.value.code == 0
    lines = both.getvalue().splitlines()
    (answer,) = (number for number, line in enumerate(lines) if line.startswith("Not decided: "))
    notes = [number for number, line in enumerate(lines) if line.startswith("note: ")]
    notes = [number for number in notes if "compiling the kernels" not in lines[number]]
    assert notes and min(notes) > answer, "notes stand after the answer"
    assert any(line.startswith("best trial, not proved better: study/tuned") for line in lines)
    last = f"next: navbench tune --resume {place / 'study'} --test-episodes 20"
    assert lines[-1].replace("resume study", f"resume {place / 'study'}") == last
    heads = follow(capsys, shlex.split(NEXT.search(lines[-1])[1]))  # type: ignore[index]
    assert "; 2 training missions, 20 for the test" in heads[0] and len(heads) == 2
    again = printed(capsys, "tune", "--resume", "study")
    assert any(line.startswith("Keep your file: ") for line in again), "it stays decided"
    assert "20 for the test" in again[0]


def test_notes_stand_after_the_answer_and_before_the_next_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    both = io.StringIO()
    monkeypatch.setattr(sys, "stdout", both)
    monkeypatch.setattr(sys, "stderr", both)
    print_with_notes([Text("answer", "whole"), Text("next", "whole")], ["first", "second"])
    assert both.getvalue().splitlines() == ["answer", "note: first", "note: second", "next"]


def test_names_between_colons_become_no_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    named = "runs/street:b: late"
    print_blocks([Text(named, "whole"), Table("", ("Run",), [(named,)])], report_console())
    say(named)
    told = capsys.readouterr()
    assert (told.out.count(named), told.err.count(named)) == (2, 1)


class Terminal(io.StringIO):
    """One that is 80 characters wide."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_breaks_lines_between_words_and_no_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    told, command = " ".join(["deliveries"] * 12), f"navbench run {'--stack a ' * 12}--episodes 9"
    for terminal, lines in (
        (Terminal(), [" ".join(["deliveries"] * 7), f"{' '.join(['deliveries'] * 5)}:", command]),
        (io.StringIO(), [f"{told}: {command}"]),
    ):
        print_blocks([Text(f"{told}: {command}", "whole")], report_console(terminal))
        assert [line.rstrip() for line in terminal.getvalue().splitlines()] == lines


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "finished"),
    [
        (["run", "--stack", STACKS[0], "--stack", "parked", "--episodes", "2"], 3),
        (["run", "--stack", "parked", "--episodes", "2", "--page"], 0),
        (["ablate", "--localizers", "ground_truth,gps", "--episodes", "2"], 2),
    ],
)
def test_an_interrupt_leads_on_by_one_command_that_works(
    capsys: pytest.CaptureFixture[str],
    place: Path,
    hall: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    finished: int,
) -> None:
    def interrupted(tally: Tally, *more: Any) -> None:
        if tally.done == finished - 1:
            raise KeyboardInterrupt
        add(tally, *more)

    add = Tally.add
    where = ["--map", str(hall), "--rules", "short.yaml", "--pedestrians", "3", "--workers", "1"]
    both = io.StringIO()
    with monkeypatch.context() as joined:
        joined.setattr(Tally, "add", interrupted)
        if not finished:
            joined.setattr(Workers, "run", interrupt)
        joined.setattr(sys, "stdout", both)
        joined.setattr(sys, "stderr", both)
        with pytest.raises(SystemExit) as leaving:
            main([*words, *where, "--out", "part"])
    lines = both.getvalue().splitlines()
    assert leaving.value.code == 130 and len(lines) <= MOST_LINES
    assert any(line.startswith(f"interrupted after {finished} of ") for line in lines)
    assert [line for line in lines if "navbench " in line] == lines[-1:], "one command, the last"
    more = " --page" if "--page" in words else ""
    assert re.sub(r"/\S*/", "", lines[-1]) == f"next: navbench {words[0]} --resume part{more}"
    heads = follow(capsys, shlex.split(NEXT.search(lines[-1])[1]))  # type: ignore[index]
    assert "n = 2" in heads[0] and len(heads) > 1
