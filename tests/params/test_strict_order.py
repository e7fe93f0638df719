"""Which of several errors of a file is told does not depend on chance."""

from dataclasses import make_dataclass

import pytest

from navstack.errors import ParameterError
from navstack.params.strict import from_mapping

NAMES = [f"value_{letter}" for letter in "qwertyuiopasdfgh"]


def test_the_first_field_that_is_wrong_is_told() -> None:
    """In the order of the fields, whatever the order in the file or the seed of hashes."""
    kind = make_dataclass("Kind", [(name, float) for name in NAMES])
    with pytest.raises(ParameterError, match=f"file: {NAMES[0]}"):
        from_mapping(kind, {name: "x" for name in reversed(NAMES)}, "file")
