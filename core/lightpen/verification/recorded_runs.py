"""A task done with recorded images: folders, videos and records, one a run."""

from dataclasses import dataclass, replace

from lightpen.formats.hashes import all_hashed
from lightpen.swing.serial_queue import Report
from lightpen.verification.choices import TaskKind
from lightpen.verification.keeping import TouchedImages
from lightpen.verification.places import runs_at, touch_place
from lightpen.verification.session import measure_with_drift
from lightpen.verification.session_state import (
    Found,
    SessionSetup,
    Unwitnessed,
    with_drift,
)
from lightpen.verification.sources import touch_run, witness_of
from lightpen.verification.tip_in_force import TipInForce, tip_at
from lightpen.verification.touching import TouchRules


@dataclass(frozen=True, eq=False)
class Done:
    """What a task has found, with which tip, by which images."""

    task: TaskKind
    found: Found
    tip: TipInForce
    images: TouchedImages


@dataclass(frozen=True, eq=False)
class ReadRuns:
    """What recorded images have found.

    Attributes
    ----------
    touched : Unwitnessed
        Their touches, in which a witness that is read later may count.
    """

    done: Done
    touched: Unwitnessed


def read_runs(
    task: TaskKind,
    place: str,
    tip: TipInForce,
    setup: SessionSetup,
    rules: TouchRules,
    report: Report,
) -> ReadRuns:
    """Return what recorded images have found.

    Parameters
    ----------
    setup : SessionSetup
        With how far the camera moved meanwhile, where that is known; fixed lamps in
        the images count besides.
    """
    rig = tip.viewers.rig
    places = [touch_place((run,), rig) for run in runs_at(place, rig)]
    tip = tip_at(tip, places[0])
    setup = replace(setup, instrument=tip.instrument, cone_cam=tip.cone_cam)
    runs = []
    for i, each in enumerate(places, start=1):
        runs.append(touch_run(each, tip.instrument, rules))
        report(i / len(places))
    witness = witness_of(runs, tip.instrument, setup.choices.limits)
    named = [(run.name, run.touches) for run in runs]
    touched = Unwitnessed(task, named, with_drift(setup, witness), witness)
    found = measure_with_drift(setup, touched)
    images = TouchedImages(
        origin=places[0].origin,
        files=all_hashed([file for each in places for file in each.files]),
        rejected=tuple(image for run in runs for image in run.rejected),
        witness=witness,
    )
    return ReadRuns(Done(task, found, tip, images), touched)
