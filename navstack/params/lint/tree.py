"""Rules about what Nav2's default behavior tree asks of the servers."""

from collections.abc import Iterator

from navstack.params.lint.rule import Finding, RuleGroup
from navstack.params.lint.subject import CONTROLLER, Subject
from navstack.params.nav2_file.nodes import DEFAULT_TREES
from navstack.params.nav2_file.views import DEFAULT_CONTROLLER, DEFAULT_PLANNER, PLANNER

TREE_KEY = "default_nav_to_pose_bt_xml"

RULES = RuleGroup("Behavior tree", CONTROLLER)


@RULES.warning
def tree_finds_no_plugin(subject: Subject) -> Iterator[Finding]:
    """A server lacks the plugin that Nav2's default tree asks for.

    Why: Nav2 refuses every goal, since the server knows no plugin of this name; here the first of
    the list runs.
    """
    if not _runs_default_tree(subject):
        return
    for node, key, name in (
        (CONTROLLER, "controller_plugins", DEFAULT_CONTROLLER),
        (PLANNER, "planner_plugins", DEFAULT_PLANNER),
    ):
        names = subject.names(node, key)
        if names and name not in names:
            yield Finding(
                key,
                f"{', '.join(names)}, but {DEFAULT_TREES[0]} asks for {name}",
                f"rename {names[0]} to {name}, in the list and in its section, "
                f"or name a tree of your own in bt_navigator {TREE_KEY}",
                node,
            )


@RULES.warning
def ambiguous_checker(subject: Subject) -> Iterator[Finding]:
    """Several goal or progress checkers are listed, and Nav2's default tree names none.

    Why: Nav2 takes the only checker or none at all: every goal is aborted; here the first of the
    list runs.
    """
    if not _runs_default_tree(subject):
        return
    for kind in ("goal_checker", "progress_checker"):
        names = subject.names(CONTROLLER, f"{kind}_plugins")
        if len(names) > 1:
            yield Finding(
                f"{kind}_plugins",
                f"{', '.join(names)}, "
                f"but {DEFAULT_TREES[0]} (Jazzy's) gives FollowPath no {kind}_id",
                f"{kind}_plugins: [{names[0]}], or a tree of your own with {kind}_id",
            )


def _runs_default_tree(subject: Subject) -> bool:
    """Whether the file names no behavior tree of its own."""
    tree = str(subject.value("bt_navigator", TREE_KEY, ""))
    return tree.rpartition("/")[2] in ("", *DEFAULT_TREES)
