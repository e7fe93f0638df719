"""The workflows that check the Nav2 file of a pull request, and comment on it."""

import os
import shlex
import subprocess
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

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


HOSTILE = (
    "[see the full report][1] ![ok][2]\n\n# Approved\n**by all** @somebody #1\n"
    "[1]: https:\\/\\/evil.example\n[2]: https:&#47;&#47;evil.example/pixel.png\n"
    "<img src=x>\n```\nhttps://evil.example www.evil.example\n"
)


@pytest.mark.parametrize("check", [HOSTILE, "", None])
def test_of_a_comment_nothing_works_as_a_link(tmp_path: Path, check: str | None) -> None:
    """The step's own script, with a stand-in for gh."""
    (job,) = load_yaml(EXAMPLES / COMMENTING)["jobs"].values()
    gh = tmp_path / "bin" / "gh"
    gh.parent.mkdir()
    gh.write_text('#!/bin/sh\ncase "$*" in *pulls*) echo 3;; esac\n')
    gh.chmod(0o755)
    if check is not None:
        (tmp_path / "found").mkdir()
        (tmp_path / "found" / "check.md").write_text(check)
    path = f"{gh.parent}:{os.environ['PATH']}"
    script = ["bash", "-e", "-c", job["steps"][1]["run"]]
    subprocess.run(script, cwd=tmp_path, env={"PATH": path, "GH_REPO": "a/b"}, check=True)
    text = (tmp_path / "comment.md").read_text()
    assert text.endswith("<!-- nav2-check -->\n")
    html = MarkdownIt("gfm-like", {"linkify": False}).render(text)
    assert not any(tag in html for tag in ("<a ", "<img", "<h1", "<strong", "<h2"))
    if not check:
        assert "gave no verdict" in html


def test_the_workflow_runs_a_command_that_there_is() -> None:
    (job,) = load_yaml(EXAMPLES / CHECKING)["jobs"].values()
    (text,) = (step["run"] for step in job["steps"] if "navbench check" in step.get("run", ""))
    line = text[text.index("navbench check") :]
    _, name, *words = shlex.split(line.replace("\\\n", " ").partition(" >")[0])
    assert any(name in commands for commands in COMMANDS.values())
    context = check.make_context(name, words)
    assert context.params["fail_if"] == "worse" and str(context.params["markdown"]) == "check.md"
