import pytest

from navstack.params.nav2_file.file import inspect_nav2


@pytest.fixture
def inspect(tmp_path):
    """The file of a text, errors kept as notices."""

    def _inspect(text, **options):
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        return inspect_nav2(path, **options)

    return _inspect
