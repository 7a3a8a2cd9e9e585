"""Interrupted at any moment, a verification is offered, gone on with, or closed."""

import pickle
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from copy import deepcopy
from functools import partial
from pathlib import Path

import pytest
from msgspec.structs import replace as replace_entries
from tests.accepted_tip import Hold, accept_tip, leant, round_a_ring
from tests.verifying import BAR, NOON, PART_CHOICES, TIMEOUT, Verifier

from lightpen.archive.logbook import Logbook
from lightpen.model.artefacts import Side
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.session import SessionState
from lightpen_extensions.measure.storage.session_files import abandon_interrupted
from lightpen_extensions.measure.storage.session_record import (
    CONCLUDED,
    InterruptedVerification,
    find_interrupted,
)
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import VerificationChoices

# Verifies until it is killed, at most one touch longer than said, and tells how many
# touches count.
PROGRAM = """
import os, pickle, sys, time
from itertools import islice
from pathlib import Path
from tests.verifying import PART_CHOICES, Verifier
from tests.core.extensions.measure.storage.test_resuming import acts

folder = Path(sys.argv[1])
verifier = Verifier(folder, pickle.loads(Path(sys.argv[2]).read_bytes()))
verifier.come(PART_CHOICES)
for act in islice(acts(verifier), int(sys.argv[3]) + 1):
    act()
    os.write(1, b"touched\\n")
    time.sleep(0.01)
time.sleep(600)
"""


def acts(verifier: Verifier) -> Iterator[Callable[[], None]]:
    """Yield what is done for a whole plan, touch by touch."""
    for hold in (*round_a_ring(11, 31.751)[:10], *BAR):
        yield partial(verifier.touch, hold)


N_ACTS = 10 + 2


@pytest.fixture
def in_force(tmp_path: Path, prepared: Preparation) -> Path:
    """A data folder with a tip in force."""
    accept_tip(tmp_path, prepared)
    return tmp_path


@pytest.fixture
def verifying(
    in_force: Path, prepared: Preparation
) -> Iterator[Callable[[Path], Verifier]]:
    """Return a function that makes who verifies in a data folder."""
    all_of_them: list[Verifier] = []

    def verifier_in(folder: Path = in_force) -> Verifier:
        verifier = Verifier(folder, prepared)
        verifier.runner.ask(lambda workflow: workflow.choose(prepared, PART_CHOICES))
        all_of_them.append(verifier)
        return verifier

    yield verifier_in
    for each in all_of_them:
        each.runner.shut_down()
        assert each.runner.await_end(TIMEOUT)


Verifying = Callable[..., Verifier]


def interrupted_in(folder: Path) -> InterruptedVerification:
    (found,) = find_interrupted(folder)
    return found


def go_on(verifier: Verifier) -> SessionState:
    """Go on with what was interrupted, and return what is there then."""
    interrupted = interrupted_in(verifier.folder)
    verifier.runner.ask(lambda workflow: workflow.continue_session(interrupted))
    verifier.runner.ask(lambda workflow: workflow.note_arrival())
    verifier.ear.wait_until(lambda: verifier.status.began is not None)
    assert verifier.ear.faults == []
    assert verifier.status.state is not None
    return verifier.status.state


def touched(state: SessionState) -> list[list[float]]:
    """Return all points that are touched for what is not done yet."""
    runs = (*state.runs, state.touches)
    return [touch.point_cam.tolist() for run in runs for touch in run]


@pytest.mark.slow
def test_after_any_touch_a_verification_goes_on_as_it_was(
    in_force: Path, tmp_path_factory: pytest.TempPathFactory, verifying: Verifying
) -> None:
    """A copy of the folder is what a kill would have left there."""
    first, copies = verifying(), []
    first.come(PART_CHOICES)
    for n, act in enumerate(acts(first), start=1):
        act()
        if n in (2, 9, 10, N_ACTS - 1):
            copy = tmp_path_factory.mktemp("killed") / "data"
            shutil.copytree(in_force, copy)
            copies.append((n, copy, first.status.state, deepcopy(first.holder)))
    assert first.status.is_done
    assert find_interrupted(in_force) == ()

    for n, copy, before, holder in copies:
        second = verifying(copy)
        state = go_on(second)
        second.holder = holder
        assert before is not None
        assert touched(state) == touched(before)
        if n in (2, N_ACTS - 1):
            for act in list(acts(second))[n:]:
                act()
            assert second.status.is_done
            (conclusion,) = second.conclusions
            assert conclusion["outcome"] != "abandoned"
            (part,) = second.records
            assert part["characteristics"] == first.records[0]["characteristics"]
            assert len(conclusion["records"]) == 1
            assert find_interrupted(copy) == ()
            verdicts = {open_record(run).verdict for run in second.runs}
            assert verdicts == {CONCLUDED}


@pytest.mark.slow
@pytest.mark.parametrize("n_touches", [1, 5])
def test_killed_it_is_offered_and_keeps_every_touch(
    in_force: Path, prepared: Preparation, verifying: Verifying, n_touches: int
) -> None:
    chosen = in_force / "prepared.pickle"
    chosen.write_bytes(pickle.dumps(prepared))
    words = [sys.executable, "-c", PROGRAM, str(in_force), str(chosen), str(n_touches)]
    root = Path(__file__).parents[5]
    with subprocess.Popen(words, stdout=subprocess.PIPE, cwd=root) as process:
        assert process.stdout is not None
        for _ in range(n_touches):
            assert process.stdout.readline()
        assert find_interrupted(in_force) == ()  # it is under way there
        process.kill()
        n_touches += len(process.stdout.readlines())
    state = go_on(verifying())

    assert len(touched(state)) in (n_touches, n_touches + 1)  # one may not be reported


# Verifies and is killed when the images of a run are kept and nothing else is yet.
KILLED_AT_THE_END = """
import os, pickle, signal, sys
from pathlib import Path
from lightpen_extensions.measure.storage.session_record import SessionRecord
from tests.verifying import PART_CHOICES, Verifier
from tests.core.extensions.measure.storage.test_resuming import acts

follow, last = SessionRecord.follow, int(sys.argv[3])

def follow_until_killed(self, before, transition):
    if transition.finished or len(transition.state.runs) > max(len(before.runs), last):
        os.kill(os.getpid(), signal.SIGKILL)
    follow(self, before, transition)

SessionRecord.follow = follow_until_killed
verifier = Verifier(Path(sys.argv[1]), pickle.loads(Path(sys.argv[2]).read_bytes()))
verifier.come(PART_CHOICES)
for act in acts(verifier):
    act()
"""


@pytest.mark.slow
@pytest.mark.parametrize("n_runs", [0, 1, 2], ids=["feature", "end", "whole part"])
def test_killed_after_the_last_image_of_a_run_no_point_is_lost(
    in_force: Path, prepared: Preparation, verifying: Verifying, n_runs: int
) -> None:
    chosen = in_force / "prepared.pickle"
    chosen.write_bytes(pickle.dumps(prepared))
    words = [sys.executable, "-c", KILLED_AT_THE_END]
    words += [str(in_force), str(chosen), str(n_runs)]
    killed = subprocess.run(words, cwd=Path(__file__).parents[5], check=False)
    assert killed.returncode == -signal.SIGKILL

    second = verifying()
    state = go_on(second)

    if n_runs < 2:
        assert [len(run) for run in state.runs] == [10, 1][: n_runs + 1]
        second.touch(*BAR[n_runs:])
    second.ear.wait_until(lambda: second.status.is_done)
    (part,) = second.records
    assert len(part["touches"]) == N_ACTS
    assert second.conclusions[0]["outcome"] != "abandoned"
    assert find_interrupted(in_force) == ()


@pytest.mark.slow
def test_a_part_goes_on_after_a_kill_and_gives_the_same_figures(
    in_force: Path, verifying: Verifying, tmp_path_factory: pytest.TempPathFactory
) -> None:
    features = tuple(plate_plan().feature(name) for name in ("dome", "hole 1"))
    features = tuple(replace_entries(each, side=Side.AUTO) for each in features)
    plan = Plan("Two features", features)
    choices = VerificationChoices(PART.kind, plan, n_frames=2)
    holds = []
    for run, planned in enumerate(features):
        for step in range(planned.n_touches):
            goal = PART.hand(choices, run, step)
            assert goal.point is not None
            assert goal.outwards is not None
            holds += [
                Hold(tuple((goal.point + away * goal.outwards).tolist()), tilt=0.1)
                for away in (10.0, 5.0)
            ]
    copies = []
    first = verifying()
    first.come(choices)
    for n, (above, at) in enumerate(batched(holds), start=1):
        first.see(first.holder.still(above, 2))
        first.touch(at)
        if n in (3, 8):
            copy = tmp_path_factory.mktemp("killed") / "data"
            shutil.copytree(in_force, copy)
            copies.append((n, copy, deepcopy(first.holder)))
    (record,) = first.records
    assert all(each["approach_cam"] for each in record["touches"])
    assert {each["side_by"] for each in record["features"]} == {"approach"}

    for n, copy, holder in copies:
        second = verifying(copy)
        go_on(second)
        second.holder = holder
        for above, at in list(batched(holds))[n:]:
            second.see(second.holder.still(above, 2))
            second.touch(at)
        (again,) = second.records
        for name in ("features", "touches", "characteristics"):
            assert again[name] == record[name]


def batched(holds: list[Hold]) -> Iterator[tuple[Hold, Hold]]:
    """Return where the ball is above a place, and on it."""
    return zip(holds[::2], holds[1::2], strict=True)


def test_a_touch_that_was_not_complete_does_not_count(
    in_force: Path, verifying: Verifying, tmp_path_factory: pytest.TempPathFactory
) -> None:
    first = verifying()
    first.come()
    first.touch(*leant(4)[:2])
    first.see(first.holder.still(leant(4)[2], 5))  # of which two may count
    copy = tmp_path_factory.mktemp("killed") / "data"
    shutil.copytree(in_force, copy)
    second = verifying(copy)
    assert len(go_on(second).touches) == 2

    second.touch(*leant(4)[2:])
    (point,) = second.records
    (run,) = second.runs
    assert len(point["touches"]) == 4
    assert len(open_record(run).images) == 14
    assert len(open_record(run).used_images) == 12


def test_what_is_closed_is_an_abandoned_verification_in_the_archive(
    in_force: Path, verifying: Verifying, tmp_path_factory: pytest.TempPathFactory
) -> None:
    first = verifying()
    first.come(PART_CHOICES)
    first.touch(*round_a_ring(11, 31.751)[:10])
    first.see(first.holder.still(BAR[0], 5))
    copy = tmp_path_factory.mktemp("killed") / "data"
    shutil.copytree(in_force, copy)
    second = verifying(copy)
    interrupted = interrupted_in(copy)
    left_over = interrupted.path.read_bytes()
    abandon_interrupted(copy, interrupted, NOON)
    interrupted.path.write_bytes(left_over)  # as if killed before it was deleted

    assert find_interrupted(copy) == ()
    assert not interrupted.path.exists()
    (conclusion,) = second.conclusions
    assert conclusion["outcome"] == "abandoned"
    assert (conclusion["operator"], conclusion["tip"]) == ("Ann", "T-10")
    assert conclusion["records"] == []
    verdicts = [open_record(run).verdict for run in second.runs]
    assert verdicts == [DISCARDED]
    logbook = Logbook(copy)
    with closing(logbook.database):
        assert logbook.enter_owed() == ()


def test_with_another_tip_in_force_it_cannot_be_gone_on_with(
    in_force: Path,
    prepared: Preparation,
    verifying: Verifying,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    first = verifying()
    first.come()
    first.touch(leant(4)[0])
    copy = tmp_path_factory.mktemp("killed") / "data"
    shutil.copytree(in_force, copy)
    accept_tip(copy, prepared, seed=4)
    second = verifying(copy)
    second.runner.ask(lambda workflow: workflow.continue_session(interrupted_in(copy)))
    second.ear.wait_until(lambda: second.ear.faults == ["under-way.other-tip"])

    assert second.status.began is None
    assert interrupted_in(copy).under_way is not None


def test_a_damaged_file_is_reported_and_put_aside(
    in_force: Path, verifying: Verifying, tmp_path_factory: pytest.TempPathFactory
) -> None:
    first = verifying()
    first.come()
    first.touch(leant(4)[0])
    copy = tmp_path_factory.mktemp("killed") / "data"
    shutil.copytree(in_force, copy)
    found = interrupted_in(copy)
    found.path.write_bytes(found.path.read_bytes().replace(b"LP-04", b"LP-05"))
    damaged = interrupted_in(copy)
    assert damaged.fault is not None
    assert damaged.fault.code == "under-way.damaged"
    abandon_interrupted(copy, damaged, NOON)

    assert find_interrupted(copy) == ()
