"""A task done with recorded images: folders, videos and records, one a run."""

from dataclasses import dataclass, replace

from lightpen.formats.hashes import all_hashed
from lightpen.runners.serial_queue import Report
from lightpen.verification.probing.current_tip import CurrentTip, tip_at
from lightpen.verification.probing.image_locations import runs_at, touch_place
from lightpen.verification.probing.probing import ProbingRules
from lightpen.verification.probing.sources import lamp_drift_of, touch_run
from lightpen.verification.session.session import measure_with_drift
from lightpen.verification.session.session_state import (
    RunsOfTask,
    SessionSetup,
    with_drift,
)
from lightpen.verification.storage.verification_files import TaskImages
from lightpen.verification.tasks.registry import AnyTask
from lightpen.verification.tasks.task import Found


@dataclass(frozen=True, eq=False)
class CompletedTask:
    """A task that is done: with which tip, by which images."""

    task: AnyTask
    tip: CurrentTip
    images: TaskImages


@dataclass(frozen=True, eq=False)
class ReadRuns:
    """Results from recorded images."""

    done: CompletedTask
    found: Found
    touched: RunsOfTask  # a drift reference that is read later may count in it


def read_runs(
    task: AnyTask,
    place: str,
    tip: CurrentTip,
    setup: SessionSetup,
    rules: ProbingRules,
    report: Report,
) -> ReadRuns:
    """Return the results from recorded images.

    The camera motion in between, if known, is in the setup; fixed lamps in the images
    are used in addition.
    """
    rig = tip.viewers.rig
    places = [touch_place((run,), rig) for run in runs_at(place, rig)]
    tip = tip_at(tip, places[0])
    setup = replace(setup, instrument=tip.instrument, cone_cam=tip.cone_cam)
    runs = []
    for i, each in enumerate(places, start=1):
        runs.append(touch_run(each, tip.instrument, rules))
        report(i / len(places))
    lamp_drift = lamp_drift_of(runs, tip.instrument, setup.choices.limits)
    named = [(run.name, run.touches) for run in runs]
    touched = RunsOfTask(task, named, with_drift(setup, lamp_drift), lamp_drift)
    found = measure_with_drift(setup, touched)
    images = TaskImages(
        origin=places[0].origin,
        files=all_hashed([file for each in places for file in each.files]),
        rejected=tuple(image for run in runs for image in run.rejected),
        lamp_drift=lamp_drift,
    )
    return ReadRuns(CompletedTask(task, tip, images), found, touched)
