"""Put run folders of the same missions into one that has few files.

Usage: python tools/pack_runs.py OUT RUN [RUN ...] [--newest] [--machine TEXT]

The runs have the same map, seed, world, rules and prices, and each its own stacks; with --newest
those of a stack count that stand in the last of several. OUT gets one
table of rows, one of events, one file of parameters, a manifest and checksums; every command reads
it as it reads a run folder. A RUN may be packed itself. Times of workers are left out, of the
summary, which follows from the rows, all but the economics, and of absolute paths all but names: a
map is where it is given that name. Keys that files of world and rules lack, as
earlier versions did not know them, have today's defaults. --machine is noted where a run does not
say itself on which machine it was driven.
"""

import argparse
import io
import json
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from harness.storage.checksums import write_checksums
from harness.storage.documents import json_text
from harness.storage.files import write_text
from harness.storage.manifest_file import EXTENDED, extended_from, read_manifest
from harness.storage.new_run import MANIFEST, OF_STACKS
from harness.storage.parameters import parameter_folder, write_packed
from harness.world.outcome import Rules
from harness.world.world_params import WorldParams
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass, read_text

TABLES = ("episodes", "events")
COMPLETED = {"rules.yaml": Rules, "world.yaml": WorldParams}
# what the names of a stack's files add to its own
OF_A_STACK = (".yaml", "-nav2.yaml", "-sensors.yaml", "-robot.yaml", "-ignored.txt")
LEVEL = 22  # of zstandard: written once, read often
OF_EACH = ("command", "program_sha256")  # of a manifest
MAY_DIFFER = ("stacks", "machine", "policies_sha256", EXTENDED, OF_STACKS, *OF_EACH)


def pack(runs: Sequence[Path], out: Path, machine: str, newest: bool = False) -> None:
    """Write the packed run.

    Args:
        runs: that are put together.
        out: folder, not there yet.
        machine: where a run does not say.
        newest: of a stack in several runs the last counts.

    Raises:
        InputError: the runs differ in more than their stacks, or share one.
    """
    manifests = [read_manifest(run) for run in runs]
    given = [stack["name"] for manifest in manifests for stack in manifest["stacks"]]
    if len(set(given)) < len(given) and not newest:
        raise InputError(f"a stack stands in two of the runs: {', '.join(sorted(given))}")
    chosen = {
        stack["name"]: (run, stack)
        for run, manifest in zip(runs, manifests, strict=True)
        for stack in manifest["stacks"]
    }
    names = list(chosen)
    stacks = [stack for _, stack in chosen.values()]
    _require_equal(runs, manifests)
    out.mkdir(parents=True)
    replaced = {run: {name for name in names if chosen[name][0] != run} for run in runs}
    pack_parameters(runs, out, replaced)
    for table in TABLES:
        parts = []
        for run in runs:
            part = pq.read_table(run / f"{table}.parquet")
            counts = [chosen[name][0] == run for name in part["stack"].to_pylist()]
            parts.append(part.filter(pa.array(counts, pa.bool_())))
        rows = pa.concat_tables(parts, promote_options="default")
        if "stack_number" in rows.column_names:
            numbers = [names.index(name) for name in rows["stack"].to_pylist()]
            place = rows.column_names.index("stack_number")
            rows = rows.set_column(place, "stack_number", pa.array(numbers, pa.int64()))
        write_small(rows, out / f"{table}.parquet")
    manifest = _together(runs, manifests, machine)
    write_text(out / MANIFEST, json_text({**manifest, "stacks": stacks}))
    write_checksums(out)


def pack_parameters(
    runs: Sequence[Path], out: Path, replaced: Mapping[Path, Collection[str]]
) -> None:
    """Write the parameter files of runs, equal where they have the same name, as one file.

    Args:
        runs: whose files they are.
        out: folder.
        replaced: stacks of a run that do not count, nor do their files.

    Raises:
        InputError: two runs have different files of one name.
    """
    texts: dict[str, str] = {}
    for run in runs:
        left_out = {f"{stack}{end}" for stack in replaced[run] for end in OF_A_STACK}
        for file in sorted(parameter_folder(run).iterdir()):
            if file.name in left_out:
                continue
            text = read_text(file)
            if kind := COMPLETED.get(file.name):
                text = dump_dataclass(load_dataclass(kind, file))
            if texts.setdefault(file.name, text) != text:
                raise InputError(f"'{run}' has another {file.name} than '{runs[0]}': pack it apart")
    write_packed(out, texts)


def write_small(rows: pa.Table, out: Path | BinaryIO) -> None:
    """Write a table with the encoding of each column that takes the fewest bytes.

    Measured values differ in all their low bits: streams of their equal bytes are smaller than a
    dictionary, which suits the columns with few values.
    """
    numbers = [field.name for field in rows.schema if pa.types.is_floating(field.type)]
    split = [name for name in numbers if _size(rows, name, [name]) < _size(rows, name, [])]
    _write(rows, out, split)


def _size(rows: pa.Table, name: str, split: list[str]) -> int:
    stream = io.BytesIO()
    _write(rows.select([name]), stream, split)
    return stream.tell()


def _write(rows: pa.Table, out: Path | BinaryIO, split: list[str]) -> None:
    pq.write_table(
        rows,
        out,
        compression="zstd",
        compression_level=LEVEL,
        use_dictionary=[name for name in rows.column_names if name not in split],
        use_byte_stream_split=split,
        write_statistics=False,
        store_schema=False,
    )


def _require_equal(runs: Sequence[Path], manifests: Sequence[dict[str, Any]]) -> None:
    for run, manifest in zip(runs, manifests, strict=True):
        for key in manifests[0] | manifest:
            one, other = (each.get(key) or None for each in (manifest, manifests[0]))
            if key not in MAY_DIFFER and one != other:  # of older runs a key may be missing
                raise InputError(f"'{run}' has another {key} than '{runs[0]}': pack it apart")


def _own(run: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """What a run says of itself, by stack, with the economics of its summary."""
    if OF_STACKS in manifest:
        packed: dict[str, Any] = manifest[OF_STACKS]
        return packed
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    economics = {entry["stack"]: entry["economics"] for entry in summary["runs"]}
    said = {key: manifest[key] for key in OF_EACH if key in manifest}
    if "command" in said:
        said["command"] = [_name(word) for word in said["command"]]
    return {
        stack["name"]: {**said, "economics": economics[stack["name"]]}
        for stack in manifest["stacks"]
    }


def _together(
    runs: Sequence[Path],
    manifests: Sequence[dict[str, Any]],
    machine: str,
) -> dict[str, Any]:
    """One manifest; what each of the runs says of itself stands there by stack.

    All looks that were taken at any of the runs before it was extended stand there together.
    """
    own: dict[str, Any] = {}
    for run, manifest in zip(runs, manifests, strict=True):
        own |= _own(run, manifest)
    shared = {key: value for key, value in manifests[0].items() if key not in OF_EACH}
    if "map_name" in shared:
        shared["map_name"] = _name(shared["map_name"])
    looks = sorted({seen for run in runs for seen in extended_from(run)})
    if looks:
        shared[EXTENDED] = looks
    return {"machine": {"processor": machine}, **shared, OF_STACKS: own}


def _name(word: str) -> str:
    """Of an absolute path its name: nobody else has its folder."""
    if Path(word).is_absolute():
        return Path(word).name
    return word


def main() -> int:
    """Read the command line and pack."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument("--newest", action="store_true", help="of a stack in several the last")
    parser.add_argument("--machine", default="unknown", help="where a run does not say")
    given = parser.parse_args()
    try:
        pack(given.runs, given.out, given.machine, given.newest)
    except (InputError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    size = sum(file.stat().st_size for file in given.out.iterdir())
    sys.stdout.write(f"{given.out}: {json.dumps([run.name for run in given.runs])}, {size} bytes\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
