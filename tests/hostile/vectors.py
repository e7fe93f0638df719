"""Golden vectors: ``.npz`` files, which are archives of arrays."""

import io
import json
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .case import Case, Make, pipe, put


class _Evil:
    """Unpickling it would create a file."""

    def __reduce__(self) -> Any:
        return open, ("hacked", "w")


def _archive(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def _meta(**facts: Any) -> np.ndarray:
    return np.array(json.dumps(facts))


def _raw(zeros: int = 0, **members: bytes) -> bytes:
    """An archive of raw members, each followed by so many zeros; packed as well as can be."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            with archive.open(f"{name}.npy", "w") as member:
                member.write(content)
                for _ in range(zeros >> 20):
                    member.write(bytes(1 << 20))
    return stream.getvalue()


def _header(shape: str, kind: str = "<f8", count: int = 0) -> bytes:
    """A ``.npy`` file that claims a shape, with ``count`` bytes of zeros."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(count)


ARCHIVES: dict[str, Callable[[], bytes]] = {
    "is empty": lambda: b"",
    "is a text": lambda: b"no archive",
    "is a pickle": lambda: b"cposix\nsystem\n(S'touch hacked'\ntR.",
    "is a single array": lambda: _header("(1,)", count=8),
    "is cut off": lambda: _archive(meta_json=_meta(), a=np.arange(1000.0))[:-200],
    "has damaged bytes": lambda: _damaged(
        _archive(meta_json=_meta(), a=np.random.default_rng(1).random(1000))
    ),
    "has no meta_json": lambda: _archive(a=np.zeros(3)),
    "has a pickled meta_json": lambda: _archive(meta_json=np.array([_Evil()], dtype=object)),
    "has a pickled array": lambda: _archive(
        meta_json=_meta(), navfn_costs=np.array([_Evil()], dtype=object)
    ),
    "has a meta_json that is no JSON": lambda: _archive(meta_json=np.array("{")),
    "has a meta_json that is a list": lambda: _archive(meta_json=np.array("[1]")),
    "has a meta_json nested 100 000 deep": lambda: _archive(meta_json=np.array("[" * 100_000)),
    "has a meta_json that unpacks to 512 MB": lambda: _raw(
        1 << 29, meta_json=_header(f"({1 << 29},)", "|u1")
    ),
    "has a meta_json that claims 10^18 numbers": lambda: _raw(
        meta_json=_header("(1000000000000000000,)")
    ),
    "has a meta_json of negative shape": lambda: _raw(meta_json=_header("(-5,)")),
    "has a meta_json whose header runs a program": lambda: _raw(
        meta_json=_header("__import__('os').abort()")
    ),
    "has no case": lambda: _archive(meta_json=_meta(), something=np.zeros(3)),
    "has a name that climbs": lambda: _raw(**{"../../evil": _header("(1,)", count=8)}),
}
# arrays that belong to no case are not read
UNATTRIBUTED = ("has no case", "has damaged bytes", "has a pickled array")
# changes to recorded vectors of the inflation layer
ALSO = {"are empty": ("dwb_a", "amcl"), "are not numbers": ("amcl",)}  # further files
SHAPES: dict[str, Callable[[dict[str, Any]], None]] = {
    "are cut short": lambda arrays: arrays.update(
        {name: value[:1] for name, value in arrays.items() if value.ndim}
    ),
    "are numbers for tables": lambda arrays: arrays.update(
        {n: np.float64(1) for n, v in arrays.items() if v.ndim}
    ),
    "are texts": lambda arrays: arrays.update(
        {n: v.astype(str) for n, v in arrays.items() if v.ndim}
    ),
    "are not numbers": lambda arrays: arrays.update(
        {n: np.full(v.shape, np.nan) for n, v in arrays.items() if v.ndim}
    ),
    "are empty": lambda arrays: arrays.update({n: v[:0] for n, v in arrays.items() if v.ndim}),
    "lack their facts": lambda arrays: arrays.update(meta_json=_meta()),
    "have facts of the wrong kind": lambda arrays: arrays.update(
        meta_json=_meta(cases=[1], inflation={"a": "b"})
    ),
}


def cases() -> Iterator[Case]:
    """Everything with ``python -m tools.parity --golden``."""
    for what, content in ARCHIVES.items():
        yield Case(
            f"golden file: {what}",
            "no parity" if what in UNATTRIBUTED else "vectors.npz",
            _given(content),
        )
    for what, change in SHAPES.items():
        for name in ("inflation", "navfn_small", *ALSO.get(what, ())):
            yield Case(f"golden vectors of {name}: {what}", "no parity", _changed(name, change))
    yield Case(
        "golden folder: does not exist",
        "nowhere",
        lambda folder: ["parity", "--golden", str(folder / "nowhere")],
    )
    yield Case(
        "golden folder: is empty",
        "golden folder",
        lambda folder: ["parity", "--golden", str(folder)],
    )
    yield Case("golden folder: holds a pipe", "vectors.npz", _pipe)


def _given(content: Callable[[], bytes]) -> Make:
    def make(folder: Path) -> list[str]:
        put(folder / "vectors.npz", content())
        return ["parity", "--golden", str(folder)]

    return make


def _changed(name: str, change: Callable[[dict[str, Any]], None]) -> Make:
    def make(folder: Path) -> list[str]:
        with np.load(Path(__file__).parent.parent / "golden" / f"{name}.npz") as recorded:
            arrays = {key: recorded[key] for key in recorded.files}
        change(arrays)
        np.savez(folder / f"{name}.npz", **arrays)
        return ["parity", "--golden", str(folder)]

    return make


def _damaged(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes(200) + content[middle + 200 :]


def _pipe(folder: Path) -> list[str]:
    pipe(folder / "vectors.npz")
    return ["parity", "--golden", str(folder)]
