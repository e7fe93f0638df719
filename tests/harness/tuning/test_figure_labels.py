"""Labels of tuning figures fit into them, whatever the parameters are called."""

from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from harness.report.figures import WIDTH_INCH, save_as
from harness.report.tuning.figures import _waterfall
from harness.report.tuning.tables import value_text
from harness.statistics.interval import Interval
from harness.tuning.waterfall import REST, Step, Waterfall

GAIN = Interval(1.0, 0.5, 1.5, 20)


def step(title: str, *names: str) -> Step:
    """A step from a value that is never reached."""
    return Step(title, dict.fromkeys(names, (6_000_000_000, 4)), GAIN)


def test_labels_of_a_waterfall_lie_within_the_figure() -> None:
    many = [f"parameter_number_{number}" for number in range(13)]
    steps = (
        step("approach_points", "approach_points"),
        step(" + ".join(many[:4]), *many[:4]),
        step(REST, *many),
    )
    figure = Figure(figsize=(WIDTH_INCH, 2.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    _waterfall(axes, Waterfall(steps, 0.0, 3.0, Interval(3.0, 1.0, 5.0, 20), 20, True, 640))
    figure.draw_without_rendering()
    labels = axes.get_yticklabels()
    assert [label.get_text() for label in labels[1:4]] == [
        "approach_points\n6e9 -> 4",
        "4 together",
        "the rest (13)",
    ]
    assert all(label.get_window_extent().x0 >= 0.0 for label in labels)


def test_values_are_told_in_few_characters() -> None:
    values = (6_000_000_000, 2, 2.0553, True, "partner")
    assert [value_text(value) for value in values] == ["6e9", "2", "2.055", "True", "partner"]


def test_a_users_settings_of_matplotlib_change_no_figure(tmp_path: Path, rendering: None) -> None:
    contents = []
    for settings in ({}, {"axes.facecolor": "red", "text.usetex": True, "savefig.bbox": "tight"}):
        with rc_context(settings):
            save_as([tmp_path / "a.png"], (3.0, 2.0), lambda figure: figure.add_subplot())
        contents.append((tmp_path / "a.png").read_bytes())
    assert contents[0] == contents[1]
