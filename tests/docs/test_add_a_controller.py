"""What the page's own file of parameters adds up to."""

from ruamel.yaml import YAML

from .blocks import ROOT, blocks_of


def test_the_smoother_passes_the_speed_that_the_controller_is_given() -> None:
    (text,) = (
        block.text
        for block in blocks_of(ROOT / "docs" / "add_a_controller.md")
        if block.file == "carrot.yaml"
    )
    file = YAML(typ="safe").load(text)
    controller = file["controller_server"]["ros__parameters"]["FollowPath"]
    smoother = file["velocity_smoother"]["ros__parameters"]
    assert smoother["max_velocity"][0] == controller["speed"]
