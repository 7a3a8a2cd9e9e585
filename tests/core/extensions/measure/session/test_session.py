"""A whole verification by the simulated operator, without a key."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from tests.accepted_tip import Hold, Holder, leant
from tests.verifying import BAR, CHOICES, LENGTH, found_by

from lightpen.cameras.protocol import CameraSettings
from lightpen.detection.pen_detection import PenDetection, detect_pen
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import rig_of
from lightpen_extensions.measure.measuring.plan import Plan, artefact_plan
from lightpen_extensions.measure.probing.instruments import instrument_of_files
from lightpen_extensions.measure.probing.probing import ProbingState, advance_touch
from lightpen_extensions.measure.probing_operator import ProbingOperator
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    advance_session,
    end_task,
    instruction,
    run_again,
    without_last_touch,
)
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART, sizes_of
from lightpen_extensions.measure.tasks.registry import TASKS, AnyTask
from lightpen_extensions.measure.tasks.task import Conditions
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera

LONGEST = 180.0  # s of the operator's time, from the first touch to the verdict
GIVE_UP = 240.0  # s
FRAME_RATE = 5.0  # 1/s: a quarter of the usual one, as each image is rendered


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "asks"),
    [(FIXED_POINT, "session.touch-cone"), (PART, "part.instruction")],
    ids=["fixed point", "part"],
)
def test_a_simulated_operator_completes_a_task_without_a_key(
    task: AnyTask, asks: str
) -> None:
    scene = Scene(camera=paper_camera(binning=4))
    pen = replace(scene.pen, led_sigma=0.002)
    instrument = instrument_of_files(
        rig_of(scene.camera), pen, scene.tip_pen, 1e-6 * np.eye(3), 0.01
    )
    choices = replace(CHOICES, kind=task.kind, n_frames=2)
    setup = SessionSetup(Conditions(instrument), choices)
    clock = SkippingClock()
    camera = SimulatedCamera(scene, clock)
    camera.open()
    camera.configure(CameraSettings(frame_rate=FRAME_RATE))
    camera.start()
    probing_operator = ProbingOperator(camera.operator)
    state, before, finished, first = SessionState(), None, [], None
    asked = {instruction(setup, state).code}
    is_lifted = False
    while state.task(setup) is not None and clock.now_ns() < GIVE_UP * 1e9:
        probing_operator.follow(setup, state)
        if len(state.touches) == 2 and not is_lifted:
            is_lifted = True
            camera.operator.lift()  # which the operator sees and goes on
        frame = camera.read(1.0)
        detection: PenDetection = detect_pen(
            frame.image, scene.camera, pen, None, before
        )
        before = detection
        transition = advance_session(setup, state, str(frame.seq), detection)
        state = transition.state
        asked.add(instruction(setup, state).code)
        if transition.recorded and first is None:
            first = clock.now_ns()
        if transition.finished is not None:
            finished.append(transition.finished)
    camera.close()

    assert finished == [task]
    assert first is not None
    assert (clock.now_ns() - first) * 1e-9 < LONGEST
    # A quarter of the pixels: the noise is four times that of the whole camera.
    if task is PART:
        for size in sizes_of(found_by(state, PART).part):
            assert size.deviation == pytest.approx(0.0, abs=0.05)
    assert asked >= {asks, "session.done"}


# What a hand can do wrong, seen without an image


@dataclass
class Session:
    """A verification that takes what a holder shows."""

    setup: SessionSetup
    holder: Holder
    state: SessionState = field(default_factory=SessionState)
    n_broken_off: int = 0

    def see(self, detections: Iterable[PenDetection]) -> None:
        for detection in detections:
            transition = advance_session(self.setup, self.state, "image", detection)
            self.state = transition.state
            self.n_broken_off += transition.is_broken_off

    def touch(self, *holds: Hold) -> None:
        for hold in holds:
            self.see(self.holder.still(hold))

    def says(self) -> str:
        return instruction(self.setup, self.state).code

    def choose(self, task: AnyTask, plan: Plan | None = None, n_cone: int = 4) -> None:
        chosen = replace(self.setup.choices, kind=task.kind, n_cone=n_cone)
        if plan is not None:
            chosen = replace(chosen, plan=plan)
        self.setup = replace(self.setup, choices=chosen)


@pytest.fixture
def session(instrument: Instrument) -> Session:
    setup = SessionSetup(Conditions(instrument), CHOICES)
    return Session(setup, Holder(instrument.rig, instrument.pen))


@pytest.mark.parametrize("task", TASKS, ids=[each.kind for each in TASKS])
def test_the_simulated_hand_completes_each_task(
    session: Session, task: AnyTask
) -> None:
    session.choose(task)
    for _ in range(60):
        if session.state.task(session.setup) is None:
            break
        state = session.state
        goal = task.hand(session.setup.choices, len(state.runs), len(state.touches))
        if goal.point is None:
            session.touch(Hold((0.0, 0.0, 0.0), goal.tilt, goal.direction))
        else:
            session.touch(Hold(tuple(goal.point.tolist()), 0.1))
        session.see(session.holder.away())

    found = found_by(session.state, task)
    assert found.assessment.is_accepted
    assert all(table.rows for table in task.tables(found, session.setup.conditions))


def test_a_posture_that_was_taken_before_does_not_count(session: Session) -> None:
    first, second, *_ = leant(4)
    session.touch(first, second, first)

    assert len(session.state.touches) == 2
    assert session.says() == "session.same-posture"


def test_a_pen_that_is_lifted_in_the_middle_of_a_touch_is_reported_so(
    session: Session,
) -> None:
    (first, *_) = leant(4)
    session.see(session.holder.still(first, 5))
    session.see(session.holder.away())

    assert session.n_broken_off == 1
    assert session.says() == "session.broken-off"
    assert not session.state.touches
    session.touch(first)
    assert len(session.state.touches) == 1
    assert session.says() == "session.touch-cone"


def test_a_pen_that_was_laid_down_is_no_touch_of_the_cone(session: Session) -> None:
    table = Hold((60.0, -30.0, 0.0), direction=4.0)
    session.touch(table, *leant(4)[:2])

    assert session.says() == "session.elsewhere"
    assert len(session.state.touches) == 2
    session.touch(*leant(4)[2:])
    assert session.state.done is FIXED_POINT
    assert found_by(session.state, FIXED_POINT).assessment.grade is Grade.PASS


def test_leds_that_are_not_those_of_the_pen_are_reported_and_not_counted(
    session: Session,
) -> None:
    rng = np.random.default_rng(1)
    pen = session.setup.instrument.pen
    session.holder = Holder(
        session.setup.instrument.rig,
        replace(pen, leds=pen.leds + rng.normal(0, 2.0, pen.leds.shape)),
    )
    session.touch(leant(4)[0])

    assert session.says() == "verification.leds-do-not-fit"
    assert not session.state.touches


def test_a_task_ended_early_has_what_its_touches_give(session: Session) -> None:
    session.touch(*leant(4)[:3])
    ended = end_task(session.setup, session.state)

    assert ended.finished is FIXED_POINT
    assert ended.state.done is FIXED_POINT
    too_few = end_task(session.setup, SessionState())
    assert too_few.state.fault is not None
    assert too_few.state.fault.code == "fixed-point.too-few"


# A cone that stands still, as witness that the camera does


UPRIGHT = (Hold(tilt=0.0),) * 3
BAR_PLAN = artefact_plan("Bar", [LENGTH])


@pytest.fixture
def witnessed(session: Session) -> Session:
    session.choose(DRIFT)
    return session


def visit(session: Session, *holds: Hold) -> None:
    """Touch the witness, lifting the tip in between."""
    for hold in holds or UPRIGHT:
        session.touch(hold)
        session.see(session.holder.away())


def test_a_witness_that_stands_still_is_visited_twice(witnessed: Session) -> None:
    visit(witnessed)
    assert witnessed.state.done is None
    visit(witnessed)

    drift = found_by(witnessed.state, DRIFT)
    assert len(drift.names) == 2
    assert drift.assessment.grade is Grade.STEADY
    assert witnessed.says() == "session.done"


def test_a_camera_that_moved_between_visits_is_reported(witnessed: Session) -> None:
    visit(witnessed)
    visit(witnessed, *(Hold((0.06, 0.0, 0.0), tilt=0.0),) * 3)

    drift = found_by(witnessed.state, DRIFT)
    assert drift.assessment.reason.code == "drift.moved"
    assert drift.share[0] == pytest.approx(0.06 / np.sqrt(3), rel=0.1)


def test_a_witness_held_otherwise_or_missed_does_not_count(witnessed: Session) -> None:
    visit(witnessed)
    visit(witnessed, UPRIGHT[0], Hold(tilt=0.4))
    assert witnessed.says() == "session.other-than-first"
    visit(witnessed, Hold((30.0, 0.0, 0.0), tilt=0.0))
    assert witnessed.says() == "session.elsewhere"
    assert len(witnessed.state.touches) == 1


def test_a_first_touch_beside_the_cone_does_not_hold_the_witness_up(
    witnessed: Session,
) -> None:
    visit(witnessed, Hold((30.0, 0.0, 0.0), tilt=0.0), *UPRIGHT)

    assert len(witnessed.state.runs) == 1


def test_the_last_point_taken_back_is_the_only_one_that_goes(session: Session) -> None:
    session.touch(*leant(4)[:3])
    before = session.state
    session.state = without_last_touch(before)

    assert session.state.touches == before.touches[:2]
    assert session.state.touching.taken == before.touching.taken[:2]
    assert session.state.touching.places == before.touching.places[:2]
    session.touch(leant(4)[3])
    assert len(session.state.touches) == 3


def test_runs_of_earlier_are_added_and_end_their_task(session: Session) -> None:
    session.choose(PART, BAR_PLAN)
    held = []
    for hold in BAR:
        session.state = replace(session.state, touching=ProbingState())
        for detection in session.holder.still(hold):
            touched = advance_touch(
                session.setup.instrument,
                session.setup.rules,
                session.state.touching,
                "image",
                detection,
            )
            session.state = replace(session.state, touching=touched.state)
        held.append(session.state.touching.taken)
    one = run_again(session.setup, SessionState(), held[0])
    two = run_again(session.setup, one, held[1])
    early = end_task(session.setup, one).state

    assert (len(one.runs), one.done) == (1, None)
    assert len(sizes_of(found_by(two, PART).part)) == 1
    assert sizes_of(found_by(early, PART).part) == []
    assert found_by(early, PART).missing == ("length 1 end 2",)
