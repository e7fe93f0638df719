"""What of the documents' commands is not executed as it stands: all of it, in one place."""

import re
from collections.abc import Iterable

# Options whose number is lowered to this.
AT_MOST = {
    **{"--episodes": 1, "--trials": 2, "--test-episodes": 2, "--final-episodes": 1, "--finalists": 1},
    **{"--waterfall": 0, "--time": 0.2, "--samples": 10},
}
DELIVERIES_OF = {"tune": {"--episodes": 2}}  # a search needs two missions

# Options that each command gets besides. The rules end a delivery after a second of simulated time.
SHORT_RULES = "short_rules.yaml"
SHORT_TIMEOUT = 1.0  # [s]
ADDED = {
    "run": ("--workers", "1", "--rules", SHORT_RULES, "--episodes", "1"),
    "ablate": ("--workers", "1", "--rules", SHORT_RULES, "--episodes", "1"),
    "tune": (
        *("--workers", "1", "--rules", SHORT_RULES),
        *("--episodes", "2", "--test-episodes", "2", "--final-episodes", "1", "--waterfall", "0"),
    ),
    "suite": ("--workers", "1"),
}
BESIDE_RESUME = ("--workers", "1")  # the rules of a study that goes on are its own

# Words that are exchanged.
EXCHANGED = {
    "ground_truth,gps,gps-ekf,amcl,amcl-gps": "ground_truth,gps-ekf",  # each arm is a delivery more
    "NavFn,IncrementalNavfn,RRTConnect,RRTstar,InformedRRTstar,BITstar,PRMstar": "NavFn,RRTConnect",
    "position=0.1,0.3,1.0": "position=0.3,1.0",
    "heading=2,5": "heading=2",
}

# Texts of files in the pages that are exchanged before the file is written.
IN_FILES = {
    "my_suite.yaml": (
        ("maps: [sidewalk, sidewalk_1]", "maps: [sidewalk]"),
        ("worlds: [costnav, social]", "worlds: [costnav]"),
        ("pedestrians: [0, 20]", "pedestrians: [0]"),
        ("episodes: 50", f"episodes: 1\nrules: {SHORT_RULES}"),
    ),
}

# Commands that are not executed, with the reason; their options are held against the program's parser all the same.
ELSEWHERE = "the same command with other values is executed"
NOT_EXECUTED = {
    r"navbench bench\b.*": "minutes of processor time; tests/harness/test_bench.py measures in small",
    r"navbench parity( --json)?": "half a minute of processor time; tests/parity does it, and --golden is executed",
    r"navbench scenario --all.*": "minutes of processor time; tests/scenarios drives each",
    r"navbench scenario tests/scenarios/kiosk.yaml": "seconds of driving; tests/scenarios drives it",
    r"navbench localize --bag (test1|drive|rosbag2_office)\b.*": "needs a recorded log that is not part of the project",
    r"navbench tune --stack (nav2-stock|mpc-gps-ekf|nav2-gps|my_robot_nav2.yaml) .*": f"{ELSEWHERE} in docs/tuning.md",
    r"navbench tune --stack carrot.yaml --space my_space.yaml": f"{ELSEWHERE} in docs/tuning.md",
    r"navbench tune --stack my_nav2.yaml .* --budget 1h --out results/tuned": ELSEWHERE,
    r"navbench ablate --resume results/latest": "docs/money.md and README.md go on with finished studies",
    r"navbench ablate --localizers gps,gps-ekf .*--json": ELSEWHERE,
    r"navbench run --stack nav2-gps --world social --pedestrians 40": f"{ELSEWHERE} in README.md",
    r"navbench suite (my_suite.yaml --out|--resume) results/pieces.*": "tests/harness/test_suite.py drives pieces",
    r"navbench replay results/two:mpc-gps-ekf 7 .*": f"{ELSEWHERE} in docs/run_baselines.md",
    r"navbench replay results/recorded:mpc-gps-ekf 3 .*": "delivery 3 of one; docs/bring_your_own.md executes it",
    r"navbench replay results/latest 3 .*": "delivery 3 of one; docs/bring_your_own.md executes it",
    r"navbench map new --seed 7 --name mine": f"{ELSEWHERE} in docs/bring_your_own.md",
    r"python benchmarks/.*": "minutes of processor time; only --help is executed",
    r"(dask|mpiexec|python docs/examples/\S+) .*": "needs a cluster; test_cluster_examples.py drives them",
    r"navbench run .* --executor dask .*": "needs a cluster; tests/harness/test_dask_execution.py starts one",
    r"navbench report results/mpi .*": f"{ELSEWHERE} in docs/run_baselines.md",
    r"navbench run .* --pedestrians 100 --record full --out results/crowd": "eight deliveries in a dense crowd",
    r"navbench explain results/latest 3": "delivery 3 of one; tests/harness/explain makes one up",
    r"navbench explain results/crowd.*": "needs a delivery with an injury; tests/harness/explain makes one up",
    r"make \w+": "installs into .venv, or runs this very test; only looked up in the Makefile",
    r"pip install (\.|'?navbench\[dask\]'?( dask-jobqueue)?|mpi4py mpich)": "needs an index; CI installs the project",
    r"\. \.venv/bin/activate": "a shell's own",
}


def reason_not_to(command: str) -> str | None:
    """Why a command is not executed; None: it is."""
    return next((why for pattern, why in NOT_EXECUTED.items() if re.fullmatch(pattern, command)), None)


def shortened(words: Iterable[str]) -> list[str]:
    """A navbench command line as it is executed, without the program's name."""
    _, name, *rest = (EXCHANGED.get(word, word) for word in words)
    limits = {**AT_MOST, **DELIVERIES_OF.get(name, {})}
    result = [name]
    for before, word in zip(["", *rest], rest, strict=False):
        result.append(f"{min(float(word), limits[before]):g}" if before in limits else word)
    more = BESIDE_RESUME if "--resume" in rest and name in ADDED else ADDED.get(name, ())
    for option, value in zip(more[::2], more[1::2], strict=True):
        if option not in result:
            result += [option, value]
        elif option == "--rules":
            result[result.index(option) + 1] = value
    return result
