"""What of the documents' commands is not executed as it stands: all of it, in one place."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

# Options whose number is lowered to this.
AT_MOST = {
    **{
        "--episodes": 1,
        "--trials": 2,
        "--test-episodes": 2,
        "--final-episodes": 1,
        "--finalists": 1,
    },
    **{"--waterfall": 0, "--time": 0.2, "--samples": 10, "--event": 1},
}
DELIVERIES_OF = {"tune": {"--episodes": 2}}  # a search needs two missions

# Options that each command gets besides. The rules end a delivery after a second of simulated time;
# the map is a hall.
SHORT_RULES = "short_rules.yaml"
SHORT_TIMEOUT = 1.0  # [s]
SMALL_MAP = "small/sidewalk.yaml"  # called as the map that it stands for
ADDED = {
    "run": ("--workers", "1", "--rules", SHORT_RULES, "--map", SMALL_MAP, "--episodes", "1"),
    "ablate": ("--workers", "1", "--rules", SHORT_RULES, "--map", SMALL_MAP, "--episodes", "1"),
    "tune": (
        *("--workers", "1", "--rules", SHORT_RULES, "--map", SMALL_MAP),
        *(
            "--trials",
            "2",
            "--episodes",
            "2",
            "--test-episodes",
            "2",
            "--final-episodes",
            "1",
            "--waterfall",
            "0",
        ),
    ),
    "check": ("--workers", "1", "--rules", SHORT_RULES, "--map", SMALL_MAP),
    "suite": ("--workers", "1"),
    "map show": ("--samples", "10"),
}
OF_ONE_DELIVERY = ("replay", "explain")  # a run is shortened to one delivery, whose number is 0
BESIDE_RESUME = ("--workers", "1")  # the rules of a study that goes on are its own

# Words that are exchanged, but not for a suite, whose maps are named.
EXCHANGED = {
    "sidewalk": SMALL_MAP,
    "ground_truth,gps,gps-ekf,amcl,amcl-gps": "ground_truth,gps-ekf",  # each arm is a delivery more
    "NavFn,IncrementalNavfn,Smac2D,SmacHybrid,SmacLattice,RRTConnect,BITstar": "NavFn,RRTConnect",
    # the one that goes on searching for shorter paths takes 40 s
    "NavFn,RRTstar": "NavFn,RRTConnect",
    "position=0.1,0.3,1.0": "position=0.3,1.0",
    "heading=2,5": "heading=2",
    **{"10m": "1s", "20m": "1s"},  # budgets of a check
}

# Texts of files in the pages that are exchanged before the file is written.
ON_SMALL_MAP = f'map="{SMALL_MAP}"'
IN_FILES = {
    "first_plot.py": (("episodes=4", f'episodes=1, rules="{SHORT_RULES}", {ON_SMALL_MAP}'),),
    "by_hand.py": (
        ("pedestrians=0", f"pedestrians=0, {ON_SMALL_MAP}"),
        ("stamp < 10.0", f"stamp < {SHORT_TIMEOUT}"),
    ),
    "ten_steps.py": (("pedestrians=20", f"pedestrians=20, {ON_SMALL_MAP}"),),
    "my_suite.yaml": (
        ("maps: [sidewalk, sidewalk_1]", f"maps: [{SMALL_MAP}]"),
        ("worlds: [easy, social]", "worlds: [easy]"),
        ("pedestrians: [0, 20]", "pedestrians: [0]"),
        ("episodes: 50", f"episodes: 1\nrules: {SHORT_RULES}"),
    ),
}


@dataclass(frozen=True)
class Reason:
    """Why a command is not executed."""

    why: str
    # file and function that do the like, in small; the words of ``why`` alone: empty
    test: str = ""


# Commands that are not executed; their options are held against the program's parser all the same.
NOT_EXECUTED = {
    r"navbench (identify|cost-log) .*": Reason(
        "the log of a robot is not part of the program",
        "tests/recorded/identify/test_page.py::test_from_a_log_to_a_tuned_file",
    ),
    r"navbench (run|tune) --stack my_robot_nav2.yaml --robot my_robot.yaml .*": Reason(
        "the robot file comes from that log",
        "tests/recorded/identify/test_page.py::test_from_a_log_to_a_tuned_file",
    ),
    r"navbench day .*": Reason(
        "deliveries of a second lead nowhere, and are refused",
        "tests/harness/test_day.py::test_a_day_is_told_in_25_lines_with_a_page",
    ),
    r"navbench (serve|drive) .*": Reason(
        "a node of another program takes part",
        "tests/ros2/test_drive_and_serve.py::test_our_brain_in_another_process_drives_the_same",
    ),
    r"ros2 launch .*|export ROS_DOMAIN_ID=.*|"
    r"navbench compare results/latest results/of-another-run": Reason(
        "a ROS 2 installation is not here",
        "tests/ros2/test_drive_and_serve.py::test_a_law_over_ros_2_drives_as_in_the_own_process",
    ),
    r"python -m tools\.bench\b.*": Reason(
        "minutes of processor time",
        "tests/tools/test_bench.py::test_the_document_keeps_its_contract",
    ),
    r"navbench scenario --all.*": Reason(
        "minutes of processor time", "tests/scenarios/test_scenarios.py::test_scenario"
    ),
    r"python -m tools\.(?!bench|parity).*": Reason(
        "minutes to hours of processor time; its --help is executed",
        "tests/docs/test_commands.py::test_the_program_knows_every_option",
    ),
    r"navbench (tune --stack my_robot_nav2.yaml .*|"
    r"ablate --(sensors \w+|inject \S+) --episodes 200)": Reason(
        "the like is executed on a page of its own",
        "tests/docs/test_commands.py::test_commands_of_a_page_work_one_after_the_other",
    ),
    r"navbench ablate --stack \S+ --localizers \S+ --inject .*": Reason(
        "each half is executed on the same page",
        "tests/harness/test_ablate.py::test_an_ablation_is_driven_cut_off_and_driven_on",
    ),
    r"navbench map new .*|navbench run --map my_maps/my_town.yaml .*": Reason(
        "a town takes ten seconds to make",
        "tests/maps/test_cli_map.py::test_the_shipped_world_is_the_one_that_the_command_makes",
    ),
    r"navbench map import .*|navbench run --map my_maps/imported.yaml .*": Reason(
        "it imports that town",
        "tests/maps/test_map_import.py::test_the_command_makes_a_map_that_can_be_driven_on",
    ),
    r"dask (scheduler|worker) .*|navbench run .* --executor dask .*": Reason(
        "a cluster is other processes",
        "tests/execution/test_dask_execution.py::"
        "test_studies_of_every_kind_have_the_rows_of_local_ones",
    ),
    r"navbench suite barn .*": Reason(
        "needs the challenge's worlds", "tests/study/test_barn.py::test_a_stack_drives_the_worlds"
    ),
    r"mpiexec .*": Reason(
        "needs an MPI library", "tests/execution/test_cluster_examples.py::test_mpi_drives_a_study"
    ),
    r"python docs/examples/slurm_study.py --jobs .*": Reason(
        "needs SLURM; what it would submit is executed",
        "tests/execution/test_cluster_examples.py::test_slurm_jobs_have_workers_of_one_thread",
    ),
    r"make \w+": Reason("installs into .venv, or runs this very test; looked up in the Makefile"),
    r"(python docs/examples/train_policy.py .*|"
    r"navbench run --stack docs/examples/tiny_policy.yaml .*)": Reason(
        "minutes of processor time",
        "tests/api/test_examples.py::test_a_policy_is_trained_and_driven",
    ),
    r"pip install (\.|'?navbench\[(dask|gym|street)\]'?( dask-jobqueue)?|mpi4py mpich)": Reason(
        "needs an index"
    ),
    r"\. \.venv/bin/activate": Reason("a shell's own"),
}


def reason_not_to(command: str) -> Reason | None:
    """Why a command is not executed; None: it is."""
    return next(
        (reason for pattern, reason in NOT_EXECUTED.items() if re.fullmatch(pattern, command)), None
    )


def shortened(words: Iterable[str]) -> list[str]:
    """A navbench command line as it is executed, without the program's name."""
    _, name, *rest = words
    if name != "suite":
        rest = [EXCHANGED.get(word, word) for word in rest]
    limits = {**AT_MOST, **DELIVERIES_OF.get(name, {})}
    result = [name]
    if name in OF_ONE_DELIVERY and rest[1:] and rest[1].isdigit():
        rest[1] = "0"
    for before, word in zip(["", *rest], rest, strict=False):
        result.append(f"{min(float(word), limits[before]):g}" if before in limits else word)
    added = ADDED.get(name) or ADDED.get(f"{name} {rest[0] if rest else ''}", ())
    more = BESIDE_RESUME if "--resume" in rest and added else added
    if name == "check" and rest[0].startswith("results/"):  # finished runs are not driven
        more = ()
    if any(word.endswith(".csv") for word in rest):  # people who were recorded on the map itself
        more = [word for word in more if word not in ("--map", SMALL_MAP)]
    for option, value in zip(more[::2], more[1::2], strict=True):
        if option not in result:
            result += [option, value]
        elif option == "--rules":
            result[result.index(option) + 1] = value
    return result
