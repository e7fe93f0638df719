"""Where compiled code is kept when the program's own folder cannot be written."""

import os
import tempfile
from pathlib import Path

import pytest

from harness.storage import shipped as resources

ACCESS = os.access


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program in a folder that cannot be written, for a user whose own folder cannot be made."""
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(
        resources.os, "access", lambda path, mode: path != resources._PACKAGE and ACCESS(path, mode)
    )
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def kept() -> Path:
    resources.keep_compiled_code()
    return Path(os.environ.pop("NUMBA_CACHE_DIR"))


def test_it_is_beside_the_cached_fields(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    assert kept() == tmp_path / "cache" / "numba"


def test_no_temporary_folder_is_looked_for_where_none_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nowhere() -> str:
        raise FileNotFoundError("No usable temporary directory found")

    monkeypatch.setattr(tempfile, "gettempdir", nowhere)
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    assert kept() == tmp_path / "cache" / "numba"


def test_a_folder_for_all_users_has_one_for_each_that_only_he_can_write(tmp_path: Path) -> None:
    folder = kept().parent
    assert folder == tmp_path / f"navbench-{os.getuid()}" and folder.stat().st_mode & 0o777 == 0o700
    assert kept().parent == folder, "the second time it is there"


@pytest.mark.parametrize("prepared", ["everybody's", "another user's"])
def test_code_that_others_may_have_put_there_is_never_loaded(
    prepared: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path / f"navbench-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777 if prepared == "everybody's" else 0o755)
    if prepared == "another user's":
        uid = os.getuid()
        monkeypatch.setattr(resources.os, "getuid", lambda: uid + 1)
        folder.rename(tmp_path / f"navbench-{uid + 1}")
    other = kept().parent
    assert (
        other.parent == tmp_path
        and other.name.startswith("navbench-")
        and other.stat().st_mode & 0o777 == 0o700
    )
    assert not other.name.endswith(f"-{os.getuid()}")
