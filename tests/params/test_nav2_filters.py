import pytest

from harness.task.stack import absolute_files
from navstack.errors import ParameterError
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.nav2_file.filters import MaskSource, find_mask, keepout_filters_without_mask
from navstack.params.nav2_file.views import read_costmap, read_masks

COSTMAP = """
global_costmap:
  global_costmap:
    ros__parameters:
      plugins: [static_layer, keepout, denoise_layer, inflation_layer]
      filters: [speed]
      keepout: {plugin: nav2_costmap_2d::KeepoutFilter, filter_info_topic: /keepout_info,
        override_lethal_cost: true}
      speed: {plugin: "nav2_costmap_2d::SpeedFilter", filter_info_topic: speed_info,
        speed_limit_topic: /speed_limit}
      denoise_layer: {plugin: "nav2_costmap_2d::DenoiseLayer", minimal_group_size: 5}
"""
SPEED = """
speed_filter_info_server:
  ros__parameters: {type: 1, filter_info_topic: /speed_info, mask_topic: /masks/speed,
    base: 100.0, multiplier: -1.0}
speed_mask_server:
  ros__parameters: {yaml_filename: masks/speed.yaml, topic_name: masks/speed}
"""
KEEPOUT = """
costmap_filter_info_server:
  ros__parameters: {type: 0, filter_info_topic: keepout_info, mask_topic: keepout_mask}
filter_mask_server:
  ros__parameters: {yaml_filename: masks/keepout.yaml, topic_name: /keepout_mask}
"""


def test_layers_and_filters_stand_in_their_order(inspect):
    nav2 = inspect(COSTMAP)
    assert not nav2.errors
    params = read_costmap(nav2, "global_costmap")
    assert tuple(params.enabled_layers(params.plugins)) == params.plugins
    assert params.plugins == ("static_layer", "keepout", "denoise_layer", "inflation_layer")
    assert params.enabled_layers(params.filters) == {
        "speed": SpeedFilterParams(filter_info_topic="speed_info")
    }
    assert params.layers["keepout"] == KeepoutFilterParams(
        filter_info_topic="/keepout_info", override_lethal_cost=True
    )
    assert params.layers["denoise_layer"].minimal_group_size == 5
    assert "global_costmap: speed.speed_limit_topic" in nav2.ignored


@pytest.fixture
def masks_here(tmp_path):
    """Files where the relative paths above lead."""
    folder = tmp_path / "masks"
    folder.mkdir()
    for name in ("keepout", "speed"):
        (folder / f"{name}.yaml").touch()


@pytest.mark.usefixtures("masks_here")
def test_a_mask_in_the_users_own_folder_is_found(inspect, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    text = (COSTMAP + KEEPOUT).replace("masks/keepout.yaml", '"~/masks/keepout.yaml"')
    nav2 = inspect(text)
    masks = read_masks(nav2, read_costmap(nav2, "global_costmap"))
    assert masks["keepout"].path == tmp_path / "masks" / "keepout.yaml"
    assert absolute_files(nav2)["filter_mask_server"] == str(masks["keepout"].path)


@pytest.mark.usefixtures("masks_here")
def test_masks_are_found_by_their_topics(inspect, tmp_path):
    nav2 = inspect(COSTMAP + SPEED + KEEPOUT)
    assert not nav2.errors
    assert find_mask(nav2.parameters, tmp_path, "/speed_info") == MaskSource(
        "speed_filter_info_server", "masks/speed.yaml"
    )
    masks = read_masks(nav2, read_costmap(nav2, "global_costmap"))
    assert masks["keepout"].path == tmp_path / "masks" / "keepout.yaml"
    assert masks["speed"].path == tmp_path / "masks" / "speed.yaml"
    assert (masks["speed"].info.type, masks["speed"].info.base, masks["speed"].info.multiplier) == (
        1,
        100.0,
        -1.0,
    )
    assert keepout_filters_without_mask(nav2.parameters, tmp_path) == []
    assert not [name for name in nav2.ignored if "server" in name]


@pytest.mark.parametrize(
    "servers",
    [
        "",
        SPEED.replace("topic_name: masks/speed", "topic_name: other"),
        SPEED.partition("speed_mask")[0],
    ],
    ids=["no server", "another mask", "no mask server"],
)
def test_a_speed_filter_without_mask_is_said_to_do_nothing(inspect, tmp_path, servers):
    nav2 = inspect(COSTMAP + servers)
    assert not nav2.errors
    (notice,) = [notice for notice in nav2.notices if notice.id == "no-mask"]
    assert str(notice).startswith("global_costmap: speed: has no mask and no effect")
    assert read_masks(nav2, read_costmap(nav2, "global_costmap")) == {}
    assert keepout_filters_without_mask(nav2.parameters, tmp_path) == ["global_costmap: keepout"]


@pytest.mark.usefixtures("masks_here")
@pytest.mark.parametrize(
    "path",
    [
        "/maps/keepout.yaml",
        "$(find-pkg-share mine)/keepout.yaml",
        "keepout.yaml",
        "other/keepout.yaml",
    ],
)
def test_in_place_of_a_mask_that_is_not_here_the_worlds_own_is_used(inspect, tmp_path, path):
    nav2 = inspect(COSTMAP + SPEED + KEEPOUT.replace("masks/keepout.yaml", path))
    (notice,) = [notice for notice in nav2.notices if notice.id == "no-mask"]
    assert str(notice) == (
        f"global_costmap: keepout: its mask {path} is not here; the world's own is used"
    )
    assert list(read_masks(nav2, read_costmap(nav2, "global_costmap"))) == ["speed"]
    assert keepout_filters_without_mask(nav2.parameters, tmp_path) == ["global_costmap: keepout"]
    (tmp_path / "here.yaml").touch()
    nav2 = inspect(COSTMAP + KEEPOUT.replace("masks/keepout.yaml", str(tmp_path / "here.yaml")))
    assert keepout_filters_without_mask(nav2.parameters, tmp_path) == []


@pytest.mark.usefixtures("masks_here")
def test_an_info_that_does_not_fit_its_filter_is_noted(inspect):
    nav2 = inspect(
        COSTMAP
        + SPEED.replace("type: 1", "type: 3")
        + KEEPOUT.replace("type: 0", "type: 0, base: 2.0")
    )
    notices = {notice.id: str(notice) for notice in nav2.notices}
    assert (
        "its info is of type 3: it has no effect; give 1 (percent) or 2 (m/s)"
        in notices["filter-type"]
    )
    assert "keepout filter does not use base and multiplier" in notices["filter-scale"]


def test_bad_values_are_one_clear_line(inspect):
    nav2 = inspect(COSTMAP.replace("minimal_group_size: 5", "group_connectivity_type: 6"))
    assert any("6 is none of 4, 8; Nav2 warns and takes 8" in warning for warning in nav2.warnings)
    nav2 = inspect(COSTMAP + SPEED.replace("base: 100.0", "base: much"))
    assert any("base: 'much' is not a number" in error for error in nav2.errors)


def test_filters_that_do_not_exist_here_refuse_the_costmap(inspect):
    nav2 = inspect(
        COSTMAP.replace("SpeedFilter", "BinaryFilter").replace(
            "speed_limit_topic", "binary_state_topic"
        )
    )
    with pytest.raises(
        ParameterError,
        match="speed: nav2_costmap_2d::BinaryFilter is a Nav2 plugin that is not avail",
    ):
        read_costmap(nav2, "global_costmap")
    nav2 = inspect(COSTMAP.replace("SpeedFilter", "SpeedFilters"))
    assert any("did you mean 'nav2_costmap_2d::SpeedFilter'" in error for error in nav2.errors)


@pytest.mark.usefixtures("masks_here")
def test_a_file_without_servers_gets_none_in_its_merged_form(inspect):
    merged = inspect(COSTMAP).merged()
    assert not [name for name in merged if "filter" in name or "mask" in name]
    again = inspect(inspect(COSTMAP + SPEED + KEEPOUT).dump_merged())
    assert set(read_masks(again, read_costmap(again, "global_costmap"))) == {"keepout", "speed"}
