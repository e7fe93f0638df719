"""The workflows that check the Nav2 file of a pull request, and comment on it."""

import shlex

from navbench.cli.app import COMMANDS
from navbench.cli.check import check
from navstack.params.strict import load_yaml

from .blocks import ROOT

EXAMPLES = ROOT / "docs" / "examples"
CHECKING, COMMENTING = "check_nav2_file.yml", "comment_nav2_check.yml"


def test_the_check_of_a_fork_has_no_secret_and_may_only_read() -> None:
    text = (EXAMPLES / CHECKING).read_text(encoding="utf-8")
    workflow = load_yaml(EXAMPLES / CHECKING)
    assert workflow["permissions"] == {"contents": "read"}
    assert "secrets." not in text and "pull_request_target" not in text
    # what a fork chooses, such as the name of its branch, is no part of a script
    (job,) = workflow["jobs"].values()
    assert all("${{" not in step.get("run", "") for step in job["steps"])


def test_the_comment_is_written_without_code_of_the_pull_request() -> None:
    workflow = load_yaml(EXAMPLES / COMMENTING)
    (job,) = workflow["jobs"].values()
    assert workflow["permissions"] == {"actions": "read", "pull-requests": "write"}
    assert [step.get("uses", "").partition("@")[0] for step in job["steps"]] == [
        "actions/download-artifact",
        "",
    ]
    assert "${{" not in job["steps"][1]["run"]
    assert CHECKING.removesuffix(".yml") in (EXAMPLES / COMMENTING).read_text(encoding="utf-8")


def test_the_workflow_runs_a_command_that_there_is() -> None:
    (job,) = load_yaml(EXAMPLES / CHECKING)["jobs"].values()
    (line,) = (step["run"] for step in job["steps"] if "navbench check" in step.get("run", ""))
    _, name, *words = shlex.split(line.replace("\\\n", " ").partition(" >")[0])
    assert any(name in commands for commands in COMMANDS.values())
    context = check.make_context(name, words)
    assert context.params["fail_if"] == "worse" and str(context.params["markdown"]) == "check.md"
