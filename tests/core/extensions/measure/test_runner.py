"""A verification from the tip in force to its verdict, and what is kept of it."""

from contextlib import closing
from dataclasses import replace
from queue import SimpleQueue

import numpy as np
import pytest
from tests.accepted_tip import Holder, accept_tip, leant, round_a_ring
from tests.verifying import BAR, CHOICES, NOON, PART_CHOICES, TIMEOUT, Verifier

from lightpen.archive.checks import check_archive
from lightpen.archive.logbook import Logbook
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.formats.files import sha256
from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_files import write_pen
from lightpen.record.folder import TOUCHES
from lightpen.record.library.supervision import Signature
from lightpen.record.swings.reading import (
    DISCARDED,
    JOURNAL,
    Record,
    RecordedImage,
    open_record,
)
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.session import SessionEventKind
from lightpen_extensions.measure.storage.session_record import CONCLUDED
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import VerificationChoices
from lightpen_extensions.simulator.swings import PAPER_TIP

EVE = Signature("Eve", "correct horse")
SIX_POINTS = replace(CHOICES, n_cone=6)  # as many find it


def test_a_tip_is_verified_from_the_first_touch_to_the_verdict(at_it: Verifier) -> None:
    at_it.come(SIX_POINTS)
    at_it.touch(*leant(6))

    assert at_it.status.is_done
    assert at_it.ear.events[-1] is SessionEventKind.DONE
    assert at_it.ear.faults == []
    (record,) = at_it.records
    assert record["verification"] == "fixed point"
    assert record["session"] == NOON.isoformat()
    assert record["verdict"]["grade"] == "pass"
    assert (record["operator"], record["origin"]) == ("Ann", "simulated")
    assert record["inputs"]["tip"]["file"] == "000001.json"
    limits = record["verdict"]["limits_mm"]
    assert limits == {"across": 0.01, "along": 0.03, "tip": 0.04}


def test_artefacts_are_measured_from_the_first_touch_to_the_verdict(
    at_it: Verifier,
) -> None:
    at_it.come(PART_CHOICES)
    at_it.touch(*round_a_ring(11, 31.751)[:10], *BAR)

    assert at_it.ear.events[-1] is SessionEventKind.DONE
    (record,) = at_it.records
    assert record["verification"] == "part"
    assert record["verdict"]["grade"] == "scale ok"
    assert "not the tip" in record["verdict"]["text"]
    ring, _, length = record["characteristics"]
    assert abs(ring["deviation"]) < 0.01
    assert abs(length["deviation"]) < 0.02


@pytest.mark.slow
def test_two_cameras_verify_a_tip_together(
    verifier: Verifier, prepared_by_two: Preparation
) -> None:
    verifier.preparation = prepared_by_two
    assert prepared_by_two.rig_file is not None
    rig = prepared_by_two.rig_file.rig
    verifier.holder = Holder(rig, verifier.holder.pen)
    accept_tip(verifier.folder, prepared_by_two)
    verifier.come()
    region = verifier.status.region
    assert region is not None
    assert len(region.regions) == 2
    verifier.touch(*leant(4))
    verifier.come(PART_CHOICES)
    verifier.touch(*round_a_ring(11, 31.751)[:10], *BAR)

    assert verifier.ear.faults == []
    assert verifier.ear.events[-1] is SessionEventKind.DONE
    point, part = verifier.records
    ring, _, length = part["characteristics"]
    depths = [each["noise_covariance"][2][2] for each in point["touches"]]
    assert max(depths) ** 0.5 < 0.008  # 0.02 by one camera alone
    assert abs(ring["deviation"]) < 0.005
    assert abs(length["deviation"]) < 0.02
    assert point["inputs"]["rig"]["file"] == "rig.json"
    names = [each["file"] for each in point["inputs"]["cameras"]]
    assert names == ["camera.yaml", "camera-2.yaml"]


def test_what_cannot_be_kept_is_reported_and_kept_later(at_it: Verifier) -> None:
    at_it.pick_up()
    at_it.see(at_it.holder.still(leant(4)[0], 2))  # begins, and keeps no image
    at_it.kept.parent.mkdir(exist_ok=True)
    at_it.kept.write_text("A file where the folder should be.")
    at_it.runner.ask(lambda workflow: workflow.start_over())
    at_it.ear.wait_until(lambda: bool(at_it.ear.faults))
    assert set(at_it.ear.faults) == {"results.no-folder"}

    at_it.kept.unlink()
    at_it.runner.ask(lambda workflow: workflow.note_arrival())
    at_it.ear.wait_until(lambda: bool(at_it.ear.reliefs))
    assert [each["outcome"] for each in at_it.conclusions] == ["abandoned"]


def test_nothing_is_taken_while_nobody_is_there(at_it: Verifier) -> None:
    region = at_it.status.region
    at_it.touch(leant(4)[0])
    at_it.runner.ask(lambda workflow: workflow.note_departure())
    for hold in leant(4)[1:]:
        at_it.see(at_it.holder.still(hold), region)
    assert at_it.status.state is not None
    assert len(at_it.status.state.touches) == 1

    at_it.come()
    assert len(at_it.status.state.touches) == 1
    at_it.touch(*leant(4)[1:])
    assert at_it.status.state.done is FIXED_POINT


def test_nothing_is_taken_while_it_is_paused(at_it: Verifier) -> None:
    at_it.runner.ask(lambda workflow: workflow.toggle_pause())
    at_it.touch(leant(4)[0])
    assert at_it.status.state is not None
    assert not at_it.status.state.touches
    at_it.runner.ask(lambda workflow: workflow.toggle_pause())
    at_it.touch(leant(4)[0])
    assert len(at_it.status.state.touches) == 1


def test_images_looked_at_for_something_else_are_not_taken(at_it: Verifier) -> None:
    at_it.see(at_it.holder.still(leant(4)[0]), RegionOfInterest())
    assert at_it.status.state is not None
    assert not at_it.status.state.touches


def test_without_a_tip_in_force_it_says_what_to_do(verifier: Verifier) -> None:
    verifier.come()
    assert verifier.refusal() == "verification.no-tip"
    assert not verifier.status.is_touching


def test_a_result_that_was_changed_is_refused(verifier: Verifier) -> None:
    file = accept_tip(verifier.folder, verifier.preparation)
    file.write_bytes(
        file.read_bytes().replace(b'"tip_pen_mm": [-1.3', b'"tip_pen_mm": [-1.4')
    )
    verifier.come()

    assert verifier.refusal() == "entered.changed-before"


def test_a_tip_of_another_pen_is_refused(verifier: Verifier) -> None:
    accept_tip(verifier.folder, verifier.preparation)
    pen = verifier.preparation.pen
    assert pen is not None
    other = verifier.folder / "other.json"
    write_pen(replace(pen, leds=pen.leds + 0.01), other)
    verifier.preparation = replace(verifier.preparation, pen_file=PenFile.read(other))
    verifier.come()

    assert verifier.refusal() == "verification.another-pen"


def test_what_is_not_known_is_asked_for(at_it: Verifier) -> None:
    at_it.come(VerificationChoices(PART.kind))

    assert at_it.refusal() == "part.no-plan"


def test_a_tip_that_came_into_force_meanwhile_is_verified_anew(at_it: Verifier) -> None:
    at_it.touch(*leant(4))
    at_it.runner.ask(lambda workflow: workflow.note_departure())
    accept_tip(at_it.folder, at_it.preparation, seed=4)
    at_it.come()

    assert at_it.status.task is FIXED_POINT
    assert at_it.status.files == ()
    assert len(at_it.records) == 1


def test_a_bug_pauses_it_and_loses_nothing(
    at_it: Verifier, monkeypatch: pytest.MonkeyPatch
) -> None:
    crashes: SimpleQueue[type[BaseException]] = SimpleQueue()
    at_it.touch(leant(4)[0])
    monkeypatch.setattr("threading.excepthook", lambda args: crashes.put(args.exc_type))
    at_it.see(["no sighting"])  # type: ignore[list-item]
    at_it.ear.wait_until(lambda: at_it.ear.faults == ["verification.bug"])

    assert crashes.get(timeout=TIMEOUT) is AttributeError
    assert at_it.status.is_paused
    assert at_it.status.refusal is None  # the tip is still known
    assert at_it.status.state is not None
    assert len(at_it.status.state.touches) == 1


# The images of live touches


@pytest.mark.slow
def test_a_verification_can_be_repeated_from_the_images_of_its_touches(
    at_it: Verifier,
) -> None:
    at_it.touch(*leant(4))
    at_it.come(PART_CHOICES)
    at_it.touch(*round_a_ring(11, 31.751)[:10], *BAR)
    runs = {run.name: run for run in at_it.runs}
    assert [open_record(run).verdict for run in at_it.runs] == [CONCLUDED] * 2
    for record in at_it.records:
        own = []
        for touches in record["inputs"]["touches"]:
            run = runs.pop(touches["folder"])
            assert touches["journal_sha256"] == sha256(run / JOURNAL)
            own += by_touch(open_record(run))
        assert [each["images"] for each in record["touches"]] == [
            [f"{image.number:06d}.png" for image in group] for group in own
        ]
    assert not runs


def by_touch(record: Record) -> list[list[RecordedImage]]:
    numbers = sorted({image.touch for image in record.used_images})
    return [[i for i in record.used_images if i.touch == n] for n in numbers]


def test_of_a_touch_that_was_broken_off_no_image_counts(at_it: Verifier) -> None:
    at_it.pick_up()
    at_it.see(at_it.holder.still(leant(4)[0], 5))
    at_it.see(at_it.holder.away())
    at_it.touch(leant(4)[1])
    (run,) = at_it.runs
    record = open_record(run)

    assert len(record.images) == 5
    assert len(record.used_images) == 3
    assert {image.touch for image in record.used_images} == {1}


def test_a_pen_that_lies_still_is_no_touch_until_it_was_picked_up(
    at_it: Verifier,
) -> None:
    def n_touches() -> int:
        assert at_it.status.state is not None
        return len(at_it.status.state.touches)

    lying, held = leant(4)[:2]
    at_it.see(at_it.holder.still(lying, 30))
    assert n_touches() == 0
    at_it.touch(held)
    assert n_touches() == 1
    for _ in range(2):  # it may be put down while the verification is paused
        at_it.runner.ask(lambda workflow: workflow.toggle_pause())
    at_it.see(at_it.holder.still(lying, 30))
    assert n_touches() == 1


def test_an_image_that_cannot_be_kept_does_not_count(at_it: Verifier) -> None:
    at_it.touch(leant(4)[0])
    at_it.runner.ask(lambda workflow: workflow.start_over())
    (first,) = at_it.runs
    at_it.ear.wait_until(
        lambda: at_it.status.region is not None and not at_it.status.began
    )
    assert open_record(first).verdict == DISCARDED
    (at_it.kept / TOUCHES).rename(at_it.folder / "elsewhere")
    (at_it.kept / TOUCHES).write_text("A file where the folder should be.")
    at_it.touch(leant(4)[1])
    assert set(at_it.ear.faults) == {"record.unwritable"}
    assert at_it.status.state is not None
    assert not at_it.status.state.touches

    (at_it.kept / TOUCHES).unlink()
    at_it.touch(leant(4)[2])
    assert at_it.ear.reliefs
    assert len(at_it.status.state.touches) == 1


# What became of it


@pytest.mark.slow
def test_a_tip_that_keeps_the_limits_is_accepted_with_all_its_records(
    at_it: Verifier,
) -> None:
    at_it.come(SIX_POINTS)
    at_it.touch(*leant(6)[:5])
    assert at_it.conclusions == []
    at_it.touch(leant(6)[5])
    (conclusion,) = at_it.conclusions

    assert conclusion["outcome"] == "accepted"
    assert conclusion["verdict"]["grade"] == "pass"
    assert conclusion["session"] == NOON.isoformat()
    files = sorted(at_it.kept.glob("*.json"))[:1]
    assert conclusion["records"] == [
        {"file": file.name, "sha256": sha256(file)} for file in files
    ]


def test_what_is_given_up_is_abandoned(at_it: Verifier) -> None:
    at_it.come(PART_CHOICES)
    at_it.touch(*round_a_ring(11, 31.751)[:10])
    at_it.see(at_it.holder.still(BAR[0], 5))
    at_it.runner.ask(lambda workflow: workflow.start_over())
    at_it.ear.wait_until(
        lambda: at_it.status.tip is not None and not at_it.status.began
    )
    (conclusion,) = at_it.conclusions

    assert conclusion["outcome"] == "abandoned"
    assert conclusion["records"] == []
    assert [open_record(run).verdict for run in at_it.runs] == [DISCARDED]


# What was found against a tip


@pytest.fixture
def doubted(verifier: Verifier) -> Verifier:
    """A verification that the tip has failed, as it was bent."""
    accept_tip(verifier.folder, verifier.preparation)
    verifier.holder = Holder(
        *(verifier.holder.rig, verifier.holder.pen),
        PAPER_TIP + np.array([0.3, 0.0, 0.0]),
    )
    verifier.come(replace(CHOICES, kind=FIXED_POINT.kind))
    verifier.touch(*leant(4))
    assert verifier.ear.events[-1] is SessionEventKind.FAILED
    return verifier


def test_what_was_found_against_a_tip_is_kept(doubted: Verifier) -> None:
    (point,), (conclusion,) = doubted.records, doubted.conclusions

    assert point["verdict"]["grade"] == conclusion["verdict"]["grade"] == "repeat"
    assert (conclusion["outcome"], conclusion["operator"]) == ("refused", "Ann")
    assert [each["file"] for each in conclusion["records"]] == ["000001.json"]


def test_the_archive_vouches_for_each_image_of_live_touches(at_it: Verifier) -> None:
    at_it.touch(*leant(4))
    logbook = Logbook(at_it.folder)
    with closing(logbook.database):
        assert logbook.enter_owed() == ()
        image = min((at_it.kept / TOUCHES).rglob("*.png"))
        image.write_bytes(image.read_bytes()[:-1] + b"?")
        findings = check_archive(logbook.database, at_it.folder).findings

    assert [each.code for each in findings] == ["archive.vouched-changed"]
    assert image.name in str(findings[0])
