"""A study whose files are gone gets advice that its own command takes."""

from pathlib import Path

import pytest

from harness.storage.checksums import write_checksums
from harness.storage.manifest_file import require_unchanged
from harness.storage.new_run import ABLATION
from navstack.errors import InputError


def test_a_study_without_its_declaration_is_not_sent_to_an_option_of_run(tmp_path: Path) -> None:
    declaration = tmp_path / "params" / ABLATION
    declaration.parent.mkdir()
    declaration.touch()
    write_checksums(tmp_path)
    declaration.unlink()
    with pytest.raises(InputError, match="restore it, or begin anew in another folder"):
        require_unchanged(tmp_path)
