"""Whether a changed Nav2 file earns more or less, by meetings with people."""

from pathlib import Path

from harness.analysis.check import CheckDeclaration, verdict_of
from harness.analysis.meetings_check import MeetingsChecked
from harness.economics.unseen import hit_cost
from harness.episode.files import prices_of
from harness.meetings.kept import kept_missions
from harness.meetings.looks import MeetingLooks
from harness.meetings.mission import MissionDrive
from harness.meetings.results import result_of
from harness.report.numbers import counted
from harness.storage.files import locked
from harness.study.manifest import load_study
from harness.study.places import Where
from navbench.api.meetings.driving import is_interrupted, place_of, require_local
from navbench.api.progress import Watch, say


def drive_meetings(
    path: Path, declaration: CheckDeclaration, where: Where, budget: float
) -> MeetingsChecked:
    """Drive mission after mission until a look decides or the time is over.

    Args:
        path: of the check's folder.
        declaration: how the sides were given.
        where: on this machine.
        budget: [s] of wall time.

    Raises:
        InputError: it is to be elsewhere.
    """
    require_local(where)
    study = load_study(path, where.workers)
    hit = hit_cost(prices_of(study.template.prices))
    looks = MeetingLooks(study.template.seed, hit)

    def is_decided_by(drive: MissionDrive) -> bool:
        looks.add(drive)
        return verdict_of(looks.bound, declaration.within) != "undecided"

    with locked(path):
        kept = kept_missions(path, is_ours=True)
        is_decided = any([is_decided_by(drive) for drive in kept.drives])
        if kept.number:
            say(f"going on after {counted(kept.number, 'mission')}")
        is_stopped = False
        if not is_decided:
            watch = Watch(looks, budget)
            is_stopped = is_interrupted(study, kept, where, watch, is_decided_by, watch.until)
    result = None
    if kept.drives:
        result = result_of(kept.drives, study.template.seed, hit)
    return MeetingsChecked(
        declaration=declaration,
        folder=path,
        where=place_of(study),
        bound=looks.bound,
        result=result,
        errors=kept.errors,
        is_interrupted=is_stopped,
    )
