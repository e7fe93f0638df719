"""The reader of Nav2's sources, on a small repository with each form of declaration."""

import subprocess
from pathlib import Path

import pytest

from tools.nav2.calls import declarations
from tools.nav2.parameters import Sources, read_distribution


@pytest.mark.parametrize(
    ("text", "name", "default"),
    [
        ('node->declare_or_get_parameter(plugin_name_ + ".a", 0.785 / 2.0);', "<plugin_name_>.a",
         0.3925),
        ('declare_parameter_if_not_declared(\n  node, name + ".b", rclcpp::ParameterValue(-1));',
         "<name>.b", -1),
        ('declareParameter("c", rclcpp::ParameterValue(true));  // (old', "c", True),
        ('add_parameter("d", rclcpp::ParameterValue(std::string("x")), "why, (so)");', "d", "x"),
        ('x = node->declare_or_get_parameter<double>(polygon_name_ + ".e");', "<polygon_name_>.e",
         {"type": "double"}),
        ('declare_parameter("f", rclcpp::PARAMETER_STRING_ARRAY);', "f", {"type": "string_array"}),
        ('get("g", static_cast<double>(K)); declare_parameter("h", static_cast<double>(K));', "h",
         {"type": "double"}),
        ('declare_parameter("i", std::vector<double>{0.5, -M_PI});', "i",
         [0.5, -3.141592653589793]),
        ('declare_parameter("j", names_);', "j", None),
        ('declare_parameter("k", 3.0f);', "k", 3.0),
        ('auto getParam = handler->getParamGetter(name_ + ".Group");\ngetParam(x, "l", 2);',
         "<name_>.Group.l", 2),
        ('std::string local_name = name + std::string(".smoother.");\n'
         'node->declare_or_get_parameter(local_name + "m", 1e-10);', "<name>.smoother.m", 1e-10),
        ('node->declare_or_get_parameter(getName() + "n", false);', "<getName()>.n", False),
    ],
)  # fmt: skip
def test_a_declaration_in_cpp(text: str, name: str, default: object) -> None:
    (found,) = declarations(text, is_python=False)
    assert (found.name, found.default) == (name, default)
    assert type(found.default) is type(default)


def test_a_declaration_in_python() -> None:
    text = (
        "import math\nself.declare_parameter('low', -math.pi)\nself.declare_parameter('on', True)"
    )
    found = [(each.name, each.default) for each in declarations(text, is_python=True)]
    assert found == [("low", -3.141592653589793), ("on", True)]


FILES = {
    "nav2_controller/src/parameter_handler.cpp": (
        'node->declare_parameter("controller_frequency", 20.0);'
    ),
    "nav2_controller/plugins.xml": """<class_libraries><library path="x">
      <class type="nav2_controller::SimpleGoalChecker" base_class_type="nav2_core::GoalChecker"/>
      <class type="nav2_controller::StoppedGoalChecker" base_class_type="nav2_core::GoalChecker"/>
      <class type="nav2_controller::GoneGoalChecker" base_class_type="nav2_core::GoalChecker"/>
      </library></class_libraries>""",
    "nav2_controller/include/stopped_goal_checker.hpp":
        "class SimpleGoalChecker : public nav2_core::GoalChecker {};\n"
        "class StoppedGoalChecker : public SimpleGoalChecker {};",
    "nav2_controller/plugins/simple_goal_checker.cpp":
        'declare_parameter_if_not_declared(node, plugin_name + ".xy_goal_tolerance", v(0.25));',
    "nav2_controller/plugins/stopped_goal_checker.cpp":
        'node->declare_parameter(plugin_name + ".rot_stopped_velocity", 0.25);',
    "nav2_controller/test/stopped_goal_checker.cpp": 'node->declare_parameter("wrong", 0.25);',
    "nav2_behaviors/plugins.xml":
        '<class type="nav2_behaviors::Spin" base_class_type="nav2_core::Behavior"/>',
    "nav2_behaviors/src/behavior_server.cpp": 'declare_parameter("cycle_frequency", 10.0);',
    "nav2_behaviors/plugins/spin.cpp":
        'class Spin {}; declare_parameter_if_not_declared(node, "max_rotational_vel", 1.0);',
    "nav2_costmap_2d/costmap_plugins.xml":
        '<class type="nav2_costmap_2d::ObstacleLayer" base_class_type="nav2_costmap_2d::Layer"/>',
    "nav2_costmap_2d/plugins/obstacle_layer.cpp":
        "class ObstacleLayer : public CostmapLayer {};\n"
        'declareParameter("enabled", rclcpp::ParameterValue(true));'
        'node->declare_parameter(name_ + "." + source + "." + "clearing", false);',
}  # fmt: skip


def test_a_distribution_is_read_from_a_branch(tmp_path: Path) -> None:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    git = ("git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b")
    for command in (("init", "-q", "-b", "next"), ("add", "."), ("commit", "-qm", "x")):
        subprocess.run((*git, *command), check=True)
    head = subprocess.run((*git, "rev-parse", "HEAD"), check=True, capture_output=True, text=True)
    found = read_distribution(Sources(tmp_path, "next"))
    assert found == {
        "commit": head.stdout.strip(),
        "nodes": {
            "controller_server": {"controller_frequency": 20.0},
            "behavior_server": {"cycle_frequency": 10.0, "max_rotational_vel": 1.0},
        },
        "plugins": {
            "goal_checkers": {
                "nav2_controller::SimpleGoalChecker": {"xy_goal_tolerance": None},
                "nav2_controller::StoppedGoalChecker": {
                    "xy_goal_tolerance": None,
                    "rot_stopped_velocity": 0.25,
                },
            },
            "behaviors": {"nav2_behaviors::Spin": {}},
            "layers": {
                "nav2_costmap_2d::ObstacleLayer": {
                    "enabled": True,
                    "observation_sources.*.clearing": False,
                }
            },
        },
    }
