"""The study of every stack in the default world."""

from harness.storage.shipped import names, shipped
from tools.frozen_world import study_page
from tools.frozen_world.cells import CELLS, CURBS, MAIN_PLACES


def test_every_stack_drives_at_every_place():
    shipped_stacks = names(shipped("params") / "stacks")
    barn = {name for name in shipped_stacks if name.startswith("jackal")}  # another robot's
    elsewhere = {"ros2"}  # another program's
    for place in MAIN_PLACES:
        driven = {cell.stack for cell in CELLS if cell.place == place}
        assert set(shipped_stacks) - driven == barn | elsewhere, place


def test_no_cell_is_driven_twice_and_other_curbs_are_the_published_stacks():
    assert len(set(CELLS)) == len(CELLS)
    others = {cell for cell in CELLS if cell.place not in MAIN_PLACES}
    assert {cell.stack for cell in others} == {"paper-gps"}
    assert {cell.place for cell in others} == set(CURBS) - set(MAIN_PLACES)


def test_the_page_names_stacks_that_have_not_driven(tmp_path, monkeypatch):
    monkeypatch.setattr(study_page, "EARNING", ("nav2-gps-ekf", "jackal-dwb"))
    monkeypatch.setattr(study_page, "CELLS", [])
    study_page.write_study(tmp_path)
    text = (tmp_path / "index.md").read_text(encoding="utf-8")
    assert "**Not complete: 1200 of 2400 declared deliveries are driven.**" in text
    assert "missing below: jackal-dwb" in text.replace("\n", " ")
    assert not list(tmp_path.rglob("*.pdf"))
