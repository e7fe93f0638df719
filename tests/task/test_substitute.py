"""Other plugins in the place of those that a Nav2 file names."""

from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from harness.task.study import make_study
from navstack.errors import InputError, ParameterError
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller, read_costmap, read_planner

FOREIGN = "neo_local_planner::NeoLocalPlanner"
DWB = "dwb_core::DWBLocalPlanner"


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """Nav2's own file with a controller of another package."""
    text = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")
    head, rest = text.split("    FollowPath:\n", 1)
    after = rest[rest.index("\nlocal_costmap:") :]
    section = (
        f'    FollowPath:\n      plugin: "{FOREIGN}"\n      max_vel_x: 0.61\n'
        f"      jump_threshold: 1.0\n"
    )
    path = tmp_path / "foreign.yaml"
    path.write_text(head + section + after, encoding="utf-8")
    return path


def test_a_substitute_keeps_what_the_file_says_and_takes_the_rest_from_a_shipped_file(foreign):
    study = make_study(stacks=[str(foreign)], episodes=1, substitutes=[f"FollowPath={DWB}"])
    nav2 = load_nav2(Path(study.stacks[0].nav2_file), allow_unknown=True)
    stock = load_nav2(shipped("params") / "nav2" / "stock.yaml")
    controller = read_controller(nav2)
    assert controller.type == DWB
    assert controller.params.max_vel_x == 0.61
    assert controller.params.sim_time == read_controller(stock).params.sim_time
    assert controller.params.critics == read_controller(stock).params.critics
    assert study.stacks[0].name == "foreign"


@pytest.mark.parametrize(
    ("file", "kind"), [("mppi.yaml", DWB), ("stock.yaml", "nav2_mppi_controller::MPPIController")]
)
def test_critics_of_another_controller_make_room_for_the_new_ones(tmp_path, file, kind):
    path = tmp_path / "mine.yaml"
    path.write_text((shipped("params") / "nav2" / file).read_text(encoding="utf-8"))
    study = make_study(stacks=[str(path)], episodes=1, substitutes=[f"FollowPath={kind}"])
    controller = read_controller(load_nav2(Path(study.stacks[0].nav2_file), True))
    assert controller.type == kind
    before = read_controller(load_nav2(path)).params.critics
    assert controller.params.critics and set(controller.params.critics).isdisjoint(before)


@pytest.mark.parametrize("name", ["RotateToGoal BaseObstacle PathDist GoalDist", "mine::Own"])
def test_critics_stay_where_the_new_controller_may_know_them(tmp_path, name):
    """The starter file's shim has DWB inside; what another package's critic is nobody knows."""
    text = (shipped("params") / "nav2" / "starter.yaml").read_text(encoding="utf-8")
    begin = text.index("critics: [")
    end = text.index("]", begin) + 1
    path = tmp_path / "mine.yaml"
    path.write_text(f"{text[:begin]}critics: [{', '.join(name.split())}]{text[end:]}")
    study = make_study(stacks=[str(path)], episodes=1, substitutes=[f"FollowPath={DWB}"])
    nav2 = load_nav2(Path(study.stacks[0].nav2_file), True)
    assert nav2.value("controller_server", "FollowPath.critics") == name.split()


def test_several_plugins_may_be_put_in(foreign):
    given = [f"FollowPath={DWB}", "GridBased=navstack::IncrementalNavfn"]
    study = make_study(stacks=[str(foreign)], episodes=1, substitutes=given)
    assert (
        read_planner(load_nav2(Path(study.stacks[0].nav2_file), True)).type
        == "navstack::IncrementalNavfn"
    )


def test_the_refusal_of_a_foreign_controller_names_the_way_on(foreign):
    with pytest.raises(ParameterError, match=f"{FOREIGN}.*--substitute FollowPath={DWB}"):
        read_controller(load_nav2(foreign, allow_unknown=True))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("FollowPath", "'FollowPath' is not NAME=TYPE"),
        ("=x", "is not NAME=TYPE"),
        ("FollowPath=", "is not NAME=TYPE"),
        (" = ", "is not NAME=TYPE"),
        (f"FolowPath={DWB}", "has no plugin 'FolowPath'; did you mean 'FollowPath'"),
        ("FollowPath=os.system", "FollowPath=os.system' cannot be done: unknown plugin"),
        (
            "FollowPath=dwb_core::DWBLocalPlaner",
            "did you mean 'dwb_core::DWBLocalPlanner'",
        ),
        ("GridBased=dwb_core::DWBLocalPlanner", "cannot be done: unknown plugin 'dwb_core"),
        ("FollowPath=nav2_navfn_planner::NavfnPlanner", "cannot be done: unknown plugin"),
        ("inflation_layer=os.system", "cannot be done: unknown plugin 'os.system'"),
    ],
)
def test_what_cannot_be_put_in_is_one_line(foreign, given, message):
    with pytest.raises(InputError, match=message):
        make_study(stacks=[str(foreign)], episodes=1, substitutes=[given])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("FollowPath=os.system", "stack 'parked' has no Nav2 file"),
        (f"FollowPath={DWB}", "stack 'parked' has no Nav2 file"),
        ("=x", "'=x' is not NAME=TYPE"),
        ("FollowPath", "'FollowPath' is not NAME=TYPE"),
    ],
)
@pytest.mark.parametrize("stacks", [["parked"], ["nav2-gps-ekf", "parked"]])
def test_a_stack_without_a_nav2_file_takes_no_other_plugin(stacks, given, message):
    if message.startswith("stack") and stacks[0] != "parked" and "os.system" in given:
        message = "cannot be done"  # the first stack refuses it already
    with pytest.raises(InputError, match=message):
        make_study(stacks=stacks, episodes=1, substitutes=[given])


LAYERS = """
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: ["obstacle_layer", "sonar", "mine"]
      obstacle_layer: {plugin: "nav2_costmap_2d::ObstacleLayer"}
      sonar: {plugin: "nav2_costmap_2d/NonPersistentVoxelLayer"}
      mine: {plugin: "my_layers::Gradient"}
"""


def test_all_foreign_layers_are_refused_at_once_and_may_be_left_out(tmp_path):
    path = tmp_path / "layers.yaml"
    path.write_text(LAYERS)
    with pytest.raises(ParameterError) as refused:
        read_costmap(load_nav2(path, allow_unknown=True), "local_costmap")
    message = str(refused.value)
    assert "did you mean 'nav2_costmap_2d::ObstacleLayer'?" in message
    assert "--substitute sonar=nav2_costmap_2d::ObstacleLayer" in message
    assert "without it by --substitute mine=none" in message
    given = ["sonar=nav2_costmap_2d::ObstacleLayer", "mine=none"]
    study = make_study(stacks=[str(path)], episodes=1, substitutes=given)
    nav2 = load_nav2(Path(study.stacks[0].nav2_file), allow_unknown=True)
    assert list(read_costmap(nav2, "local_costmap").layers) == ["obstacle_layer", "sonar"]


def test_only_layers_can_be_left_out(foreign):
    with pytest.raises(InputError, match="only a costmap's layers can be left out"):
        make_study(stacks=[str(foreign)], episodes=1, substitutes=["FollowPath=none"])


def test_files_of_one_name_stay_apart(foreign: Path) -> None:
    asked = [f"FollowPath={DWB}"]
    old = make_study(stacks=[str(foreign)], episodes=1, substitutes=asked).stacks[0]
    text = foreign.read_text(encoding="utf-8")
    foreign.write_text(text.replace("max_vel_x: 0.61", "max_vel_x: 0.37"), encoding="utf-8")
    new = make_study(stacks=[str(foreign)], episodes=1, substitutes=asked).stacks[0]
    files = [load_nav2(Path(stack.nav2_file), allow_unknown=True) for stack in (old, new)]
    assert [read_controller(nav2).params.max_vel_x for nav2 in files] == [0.61, 0.37]
