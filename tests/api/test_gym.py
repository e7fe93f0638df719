"""The Gymnasium environment: Gymnasium's own check, and the program's rows and dollars."""

import copy
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.economics.prices import load_prices
from harness.economics.valuation import margins
from harness.storage.shipped import ROUTE_GRAPH
from navstack.errors import InputError
from tests.rules import short_rules

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
DeliveryEnv = pytest.importorskip("navbench.gym").DeliveryEnv


@pytest.fixture
def env(hall: Path) -> Any:
    made = DeliveryEnv("nav2-gps-ekf", pedestrians=4, map=str(hall))
    yield made
    made.close()


@pytest.mark.slow
def test_gymnasium_finds_nothing_to_complain_about(hall: Path) -> None:
    from gymnasium.utils.env_checker import check_env

    given = {"stack": "nav2-gps-ekf", "map": str(hall), "pedestrians": 2, "sees_people": True}
    env = gymnasium.make("navbench.gym:navbench/Delivery-v0", **given)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_the_reward_is_the_contribution_margin(tmp_path: Path, hall: Path) -> None:
    (tmp_path / "short.yaml").write_text(short_rules(20.0))
    given = {"map": str(hall), "rules": str(tmp_path / "short.yaml")}
    env = DeliveryEnv("nav2-gps-ekf", pedestrians=4, **given)
    env.reset(seed=3)
    total, by_term, is_over = 0.0, {}, False
    rng = np.random.default_rng(0)
    while not is_over:
        _, reward, is_over, is_cut, info = env.step(np.array((0.2, rng.uniform(-0.2, 0.2))))
        assert reward == pytest.approx(sum(info["dollars"].values()))
        assert not is_cut
        total += reward
        by_term = {
            term: by_term.get(term, 0.0) + amount for term, amount in info["dollars"].items()
        }
    margin = margins([info["row"]], load_prices("costnav"))
    assert margin is not None
    assert total == pytest.approx(float(margin[0]), abs=1e-9)
    assert by_term["electricity"] < 0.0
    with pytest.raises(InputError, match=r"call reset\(\)"):
        env.step(np.zeros(2))
    env.close()


def test_seeds_and_numbers_of_deliveries(env: Any) -> None:
    first = env.reset(seed=1)[0]
    assert env.reset()[1] == {"seed": 1, "episode": 1}
    again = env.reset(options={"episode": 0})[0]
    for name, values in first.items():
        assert np.array_equal(values, again[name])
    assert env.reset(options={"episode": np.int64(3)})[1]["episode"] == 3
    for given in ({"episode": -1}, {"episode": 1.5}, {"episode": True}, {"epsiode": 1}):
        with pytest.raises(InputError, match="options.* give "):
            env.reset(options=given)
    for action in (np.array((np.nan, 0.0)), np.zeros((1, 2)), "left", None, {"turn": 1}):
        with pytest.raises(InputError, match="two finite numbers"):
            env.step(action)


def test_without_a_seed_each_draws_its_own(env: Any, hall: Path) -> None:
    drawn = [env.reset()[1]]
    with_another = DeliveryEnv("nav2-gps-ekf", pedestrians=4, map=str(hall))
    drawn += [with_another.reset()[1], with_another.reset()[1]]
    with_another.close()
    assert drawn[0]["seed"] != drawn[1]["seed"] == drawn[2]["seed"]
    assert [each["episode"] for each in drawn] == [0, 0, 1]
    chosen = DeliveryEnv("nav2-gps-ekf", pedestrians=4, map=str(hall), seed=5)
    assert chosen.reset()[1] == {"seed": 5, "episode": 0}
    chosen.close()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"pedestrains": 3}, "has no option 'pedestrains'; did you mean 'pedestrians'"),
        ({"pedestrians": "20"}, "pedestrians='20' is of another kind"),
        ({"episodes": 3}, "has no option 'episodes'"),
        ({"only": [5]}, "has no option 'only'"),
        ({"render_mode": "human"}, "render_mode='human': an environment draws nothing"),
    ],
)
def test_options_that_it_does_not_have(given: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        DeliveryEnv("nav2-gps-ekf", **given)


def test_a_localizer_that_fails_ends_the_delivery(
    env: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="seed=-1: give 0 or more"):
        env.reset(seed=-1)
    env.reset(seed=1)

    def fail(observation: object) -> bool:
        raise RuntimeError("lost")

    monkeypatch.setattr(env._brain, "sense", fail)
    _, _, is_over, _, info = env.step(np.zeros(2))
    assert is_over and info["outcome"] == "physical_assistance"
    assert info["row"]["stack_error"] == "RuntimeError: lost"


def test_one_that_is_closed_or_copied_says_so(hall: Path) -> None:
    env = DeliveryEnv("nav2-gps-ekf", pedestrians=0, map=str(hall))
    with pytest.raises(InputError, match="cannot be copied or pickled"):
        copy.deepcopy(env)
    env.close()
    for use in (env.reset, lambda: env.step(np.zeros(2))):
        with pytest.raises(InputError, match="is closed"):
            use()


@pytest.mark.slow
def test_a_camera_shows_the_same_scene_again(hall: Path) -> None:
    from gymnasium.utils.env_checker import check_env

    from navbench import CameraParams

    camera = CameraParams(40, 30)
    env = DeliveryEnv("nav2-gps-ekf", pedestrians=2, map=str(hall), camera=camera)
    check_env(env, skip_render_check=True)
    first, again = (env.reset(seed=2)[0]["image"] for _ in range(2))
    assert first.shape == (30, 40, 3) and first.std() > 1.0
    assert np.array_equal(first, again)
    env.close()


def test_a_stack_without_a_nav2_file_senses_nothing() -> None:
    with pytest.raises(InputError, match="'parked' does not drive"):
        DeliveryEnv("parked")


def test_a_district_is_no_environment(tmp_path: Path) -> None:
    (tmp_path / f"town{ROUTE_GRAPH}").write_text("")
    with pytest.raises(InputError, match="is a district, whose missions have legs"):
        DeliveryEnv("nav2-gps", map=str(tmp_path))


@pytest.mark.slow
def test_the_same_commands_give_the_rows_of_a_run(
    tmp_path: Path, hall: Path, in_process: None
) -> None:
    import navbench

    sys.path.insert(0, str(tmp_path))
    (tmp_path / "steering.py").write_text(
        "import numpy as np\n"
        "class Steering:\n"
        "    def reset(self, seed):\n"
        "        pass\n"
        "    def share(self, seen):\n"
        "        x, y = seen.route[1]\n"
        "        return np.clip((0.5, 0.8 * np.arctan2(y, x)), -1.0, 1.0)\n"
        "    def act(self, seen):\n"
        "        return self.share(seen) * (3.56, 2.5)\n"
    )
    stack = tmp_path / "steered.yaml"
    stack.write_text(
        "title: Steered\nnavigator: steering.py:Steering\nnav2_file: gps_ekf\nlocalizer: gps-ekf\n"
        "planning_map: geometry\nsensors: rtk_good\ncarries: [lidar, gps]\nrobot: segway_e1\n"
    )
    given = {"map": str(hall), "pedestrians": 4}
    run = navbench.run(str(stack), 2, seed=11, workers=1, out=tmp_path / "run", **given)
    stored = run.table().to_pylist()
    assert "sla" in {row["outcome"] for row in stored}, "none has arrived"
    from steering import Steering  # type: ignore[import-not-found]

    env, policy = DeliveryEnv(str(stack), **given), Steering()
    for episode, expected in enumerate(stored):
        env.reset(seed=11, options={"episode": episode})
        is_over = False
        while not is_over:
            _, _, is_over, _, info = env.step(policy.share(env.seen))
        assert {key: expected[key] for key in info["row"]} == info["row"]
    env.close()
    sys.path.remove(str(tmp_path))


@pytest.mark.slow
def test_several_in_processes_of_their_own(hall: Path) -> None:
    def made() -> Any:
        return DeliveryEnv("nav2-gps-ekf", pedestrians=2, map=str(hall))

    envs = gymnasium.vector.AsyncVectorEnv([made, made], context="spawn")
    try:
        seen, _ = envs.reset(seed=[0, 1])
        assert seen["route"].shape == (2, 10, 2)
        assert not np.array_equal(seen["goal"][0], seen["goal"][1])
        _, rewards, _, _, _ = envs.step(np.tile((0.3, 0.0), (2, 1)).astype(np.float32))
        assert rewards.shape == (2,)
    finally:
        envs.close()
