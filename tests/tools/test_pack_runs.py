"""Stored studies: each column in its smallest encoding, every value as it was, all few files."""

import dataclasses
import gzip
import json
import subprocess
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.world.outcome import Rules
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass
from tools import pack_runs
from tools.pack_runs import write_small

ROOT = Path(__file__).parents[2]
MOST_FILES, MOST_BYTES = 100, 12_000_000


def test_a_packed_table_is_smaller_and_holds_the_same_bits(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    measured = rng.normal(size=4000)
    measured[:2] = (-0.0, np.nan)
    rows = pa.table(
        {
            "stack": ["mpc"] * 4000,
            "episode": np.arange(4000),
            "speed_mps": pa.array(measured, mask=np.arange(4000) == 2),
            "limit_mps": rng.choice([0.5, 1.0], 4000),
        }
    )
    pq.write_table(rows, tmp_path / "plain", compression="zstd", compression_level=22)
    write_small(rows, tmp_path / "packed")
    packed = pq.read_table(tmp_path / "packed")
    assert packed.schema.equals(rows.schema)
    for name in rows.column_names:
        assert packed[name].is_null().equals(rows[name].is_null())
        before, after = (table[name].drop_null().to_numpy() for table in (rows, packed))
        assert before.tolist() == after.tolist() or before.tobytes() == after.tobytes()
    plain = (tmp_path / "plain").stat().st_size
    assert (tmp_path / "packed").stat().st_size < 0.92 * plain
    columns = pq.ParquetFile(tmp_path / "packed").metadata.row_group(0)
    split = {i for i in range(4) if "BYTE_STREAM_SPLIT" in columns.column(i).encodings}
    assert split == {2}, "only measured values"


def test_paths_of_a_machine_stay_on_it(tmp_path: Path) -> None:
    command = ["navbench", "run", "--map", "/home/ann/city", "--prices", "mine/prices.yaml"]
    manifest = {"stacks": [{"name": "a"}], "map_name": "/home/ann/city", "command": command}
    (tmp_path / "run.json").write_text(json.dumps(manifest))
    economics = [{"stack": "a", "economics": {}}]
    (tmp_path / "summary.json").write_text(json.dumps({"runs": economics}))
    packed = pack_runs._together([tmp_path], [manifest], "")
    assert packed["map_name"] == "city"
    assert packed["of_stacks"]["a"]["command"][3:] == ["city", "--prices", "mine/prices.yaml"]


def test_runs_that_were_extended_at_different_numbers_tell_all_looks(tmp_path: Path) -> None:
    runs, manifests = [], []
    for name, looks in (("a", [75, 300]), ("b", [100]), ("c", [])):
        run, manifest = tmp_path / name, {"stacks": [{"name": name}], "episodes": 400}
        if looks:
            manifest["extended_from"] = looks
        run.mkdir()
        (run / "run.json").write_text(json.dumps(manifest))
        economics = [{"stack": name, "economics": {}}]
        (run / "summary.json").write_text(json.dumps({"runs": economics}))
        runs.append(run)
        manifests.append(manifest)
    pack_runs._require_equal(runs, manifests)
    assert pack_runs._together(runs, manifests, "")["extended_from"] == [75, 100, 300]
    assert "extended_from" not in pack_runs._together(runs[2:], manifests[2:], "")


def small_run(folder: Path, duration: float, **limits: float) -> Path:
    """A finished run of two deliveries of each stack, which has a parameter of its own."""
    (folder / "params").mkdir(parents=True)
    for stack, limit in limits.items():
        (folder / "params" / f"{stack}-nav2.yaml").write_text(f"limit: {limit}\n")
    manifest = {"stacks": [{"name": stack} for stack in limits], "seed": 3}
    (folder / "run.json").write_text(json.dumps(manifest))
    economics = [{"stack": stack, "economics": {"opex": duration}} for stack in limits]
    (folder / "summary.json").write_text(json.dumps({"runs": economics}))
    names = [stack for stack in limits for _ in range(2)]
    rows = pa.table(
        {"stack": names, "stack_number": [0] * len(names), "t_s": [duration, 1.0] * len(limits)}
    )
    for table in ("episodes", "events"):
        pq.write_table(rows, folder / f"{table}.parquet")
    return folder


def test_a_stack_that_was_driven_again_takes_the_place_of_its_rows(tmp_path: Path) -> None:
    old = small_run(tmp_path / "old", 5.0, a=1.0, b=2.0)
    new = small_run(tmp_path / "new", 7.0, a=3.0)
    with pytest.raises(InputError, match="a stack stands in two of the runs: a, a, b"):
        pack_runs.pack([old, new], tmp_path / "packed", "")
    pack_runs.pack([old, new], tmp_path / "packed", "", newest=True)
    rows = pq.read_table(tmp_path / "packed" / "episodes.parquet").to_pylist()
    found = [(row["stack"], row["stack_number"], row["t_s"]) for row in rows]
    assert found == [("b", 1, 5.0), ("b", 1, 1.0), ("a", 0, 7.0), ("a", 0, 1.0)]
    manifest = json.loads((tmp_path / "packed" / "run.json").read_text())
    assert [stack["name"] for stack in manifest["stacks"]] == ["a", "b"]
    assert manifest["of_stacks"]["a"]["economics"]["opex"] == 7.0
    texts = json.loads(gzip.decompress((tmp_path / "packed" / "parameters.json.gz").read_bytes()))
    assert texts == {"a-nav2.yaml": "limit: 3.0\n", "b-nav2.yaml": "limit: 2.0\n"}


@pytest.mark.parametrize(("way_back", "is_alike"), [(False, True), (True, False)])
def test_rules_of_an_earlier_version_are_completed_by_todays(
    tmp_path: Path, way_back: bool, is_alike: bool
) -> None:
    rules = load_dataclass(Rules, ROOT / "params" / "rules" / "costnav.yaml")
    texts = {}
    for name in ("earlier", "today"):
        folder = tmp_path / name / "params"
        folder.mkdir(parents=True)
        texts[name] = dump_dataclass(dataclasses.replace(rules, way_back=way_back))
        if name == "earlier":
            texts[name] = texts[name].replace(f"way_back: {str(way_back).lower()}\n", "")
        (folder / "rules.yaml").write_text(texts[name])
    assert texts["earlier"] != texts["today"]
    runs = [tmp_path / name for name in texts]
    if is_alike:
        pack_runs.pack_parameters(runs, tmp_path, dict.fromkeys(runs, ()))
        packed = json.loads(gzip.decompress((tmp_path / "parameters.json.gz").read_bytes()))
        assert packed == {"rules.yaml": texts["today"]}
    else:
        with pytest.raises(InputError, match="another rules.yaml"):
            pack_runs.pack_parameters(runs, tmp_path, dict.fromkeys(runs, ()))


def test_the_stored_studies_fit() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout: nothing says which results are stored")
    command = ["git", "ls-files", "-z", "results"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    files = [ROOT / name for name in listed.stdout.split("\0") if name]
    assert 0 < len(files) <= MOST_FILES
    assert sum(file.stat().st_size for file in files if file.exists()) <= MOST_BYTES
