"""Live images are looked at as they come; a swing takes every one of them, in order."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.cameras.clock import SkippingClock
from lightpen.cameras.protocol import CameraSettings, ImageCamera
from lightpen.cameras.replay import ReplayCamera
from lightpen.cameras.worker import Connection, ConnectionChanged, Failed, WorkerEvent
from lightpen.detection.aim import Aim
from lightpen.detection.sighting import look
from lightpen.errors import FileError, LightpenError
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.live.looking import (
    Live,
    LiveImage,
    Swinging,
)
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.record.reading import IMAGES, Record, open_record
from lightpen.record.writing import RecordWriter
from lightpen.sentences import sentence
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.follower import Follower
from lightpen.simulator.hand import Operator
from lightpen.simulator.sample_pens import SAMPLE_PENS
from lightpen.simulator.scene_files import write_sample_files
from lightpen.simulator.scenes import Scene
from lightpen.simulator.swings import paper_camera
from lightpen.swing.preparation import Preparation
from lightpen.swing.rules import advance
from lightpen.swing.state import (
    Happening,
    Pause,
    Phase,
    SwingEvent,
    SwingState,
    start_swing,
)

TIMEOUT = 20.0  # s until a test gives up
ENDLESS = SwingLimits(max_uncertainty=1e-9)
SHORT = SwingLimits(max_uncertainty=0.05, min_images=12, min_per_field=0)


class Audience:
    """Takes what is told, may hold up the images, and lets a test wait."""

    def __init__(self) -> None:
        self.images: list[LiveImage] = []
        self.states: list[SwingState] = []
        self.happenings: list[SwingEvent] = []
        self.camera: list[WorkerEvent] = []
        self.troubles: list[LightpenError] = []
        self.threads: set[str] = set()
        self.follower: Follower | None = None
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self._changed = threading.Condition()

    def on_image(self, image: LiveImage) -> None:
        self._tell(lambda: self.images.append(image))
        self.may_go_on.wait(TIMEOUT)

    def on_swing(self, state: SwingState, events: tuple[SwingEvent, ...]) -> None:
        if self.follower is not None:
            self.follower.follow(state)
        self.threads.add(threading.current_thread().name)
        self.happenings += events
        self._tell(lambda: self.states.append(state))

    def on_camera(self, event: WorkerEvent) -> None:
        self._tell(lambda: self.camera.append(event))

    def on_trouble(self, error: LightpenError) -> None:
        self._tell(lambda: self.troubles.append(error))

    def wait_until(self, is_so: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(is_so, TIMEOUT)

    def wait_for_images(self, n_images: int) -> None:
        """Wait until so many more images were shown."""
        wanted = len(self.images) + n_images
        self.wait_until(lambda: len(self.images) >= wanted)

    def wait_for_phase(self, phase: Phase) -> None:
        self.wait_until(lambda: bool(self.states) and self.state.phase is phase)

    @property
    def state(self) -> SwingState:
        return self.states[-1]

    def _tell(self, note: Callable[[], None]) -> None:
        with self._changed:
            note()
            self._changed.notify_all()


@dataclass
class Stage:
    """A camera, what is in front of it, and who listens."""

    folder: Path
    preparation: Preparation
    seated: SwingState
    audience: Audience = field(default_factory=Audience)
    lives: list[Live] = field(default_factory=list)
    swingings: list[Swinging] = field(default_factory=list)

    def live(self, camera: ImageCamera | None = None, *, starts: bool = True) -> Live:
        """Return the live images of a camera, by default of the simulated pen."""
        live = Live(
            camera or self.pen(), CameraSettings(), self.audience, clock=SkippingClock()
        )
        self.lives.append(live)
        if starts:
            live.start()
        return live

    def pen(self) -> SimulatedCamera:
        """Return a camera that sees the pen in its cone, with a willing operator."""
        known = self.preparation.camera
        assert known is not None
        clock = SkippingClock()
        operator = Operator(clock, seated=True)
        self.audience.follower = Follower(operator)
        return SimulatedCamera(Scene(camera=known), clock, operator)

    def swinging(
        self, limits: SwingLimits = ENDLESS, state: SwingState | None = None
    ) -> Swinging:
        """Return a swing with a record of its own; the tip is in the cone by now."""
        setup = replace(self.preparation, limits=limits).swing_setup()
        writer = RecordWriter.create(
            self.folder / f"swing {len(self.swingings) + 1}", self.preparation.header()
        )
        swinging = Swinging(setup, writer, state or self.seated)
        self.swingings.append(swinging)
        return swinging

    def record(self, number: int = 1) -> Record:
        return open_record(self.folder / f"swing {number}")

    def wait_for_kept(self, n_images: int) -> None:
        """Wait until so many images of the swing are kept."""
        states = self.audience.states
        self.audience.wait_until(lambda: bool(states) and states[-1].n_kept >= n_images)

    def capture(self, n_images: int) -> Live:
        """Return live images from which so many were captured so far."""
        live = self.live()
        live.swing(self.swinging())
        self.wait_for_kept(n_images)
        return live


def is_closed(writer: RecordWriter) -> bool:
    try:
        writer.put_back([])
    except ValueError:
        return True
    return False


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    """A camera of a sixteenth of the paper's pixels, and the paper's pen."""
    files = write_sample_files(
        Scene(camera=paper_camera(binning=4)), tmp_path_factory.mktemp("files")
    )
    return Preparation(
        camera_file=CameraFile.read(files.camera), pen_file=PenFile.read(files.pen)
    )


@pytest.fixture(scope="session")
def seated(prepared: Preparation) -> SwingState:
    """A swing whose tip was found at rest, before the first image is kept."""
    setup = replace(prepared, limits=ENDLESS).swing_setup()
    clock = SkippingClock()
    operator = Operator(clock, seated=True)
    camera = SimulatedCamera(Scene(camera=setup.camera), clock, operator)
    camera.open()
    camera.start()
    state = before = start_swing(setup)
    while state.phase is not Phase.CAPTURING:
        before = state
        image = camera.read(1.0).image
        sighting = look(image, setup.camera, setup.pen)
        state = advance(setup, state, sighting, clock.now_ns() * 1e-9).state
    camera.close()
    return replace(
        before,
        phase=Phase.CAPTURING,
        since=0.0,
        time=0.0,
        last_seen=0.0,
        target_since=0.0,
        recent=(),
        still_since=None,
    )


@pytest.fixture
def stage(tmp_path: Path, prepared: Preparation, seated: SwingState) -> Iterator[Stage]:
    stage = Stage(tmp_path, prepared, seated)
    yield stage
    stage.audience.may_go_on.set()
    for live in stage.lives:
        live.stop()


# What is looked for


def test_without_camera_and_pen_an_image_shows_its_spots_only(stage: Stage) -> None:
    stage.live()
    stage.audience.wait_until(lambda: len(stage.audience.images[-1:]) == 1)
    stage.audience.wait_until(lambda: len(stage.audience.images[-1].spots) == 10)

    assert stage.audience.images[-1].sighting is None


def test_the_pen_is_sighted_as_soon_as_camera_and_pen_are_known(stage: Stage) -> None:
    live = stage.live()
    stage.audience.wait_for_images(1)
    live.set_aim(stage.preparation.aim)
    stage.audience.wait_until(lambda: sees_pen(stage.audience.images[-1]))


def sees_pen(image: LiveImage) -> bool:
    return image.sighting is not None and image.sighting.has_pose


def test_an_image_of_another_size_than_the_intrinsics_shows_spots_only(
    stage: Stage,
) -> None:
    camera, pen = stage.preparation.camera, stage.preparation.pen
    assert camera is not None
    live = stage.live()
    live.set_aim(Aim(replace(camera, width=camera.width + 1), pen))
    stage.audience.wait_until(lambda: spots_of_last(stage.audience) == 10)

    assert all(image.sighting is None for image in stage.audience.images)


def spots_of_last(audience: Audience) -> int:
    return len(audience.images[-1].spots) if audience.images else 0


def test_masked_light_is_left_out_with_and_without_a_camera(stage: Stage) -> None:
    everywhere = np.array([[306.0, 256.0, 1000.0]])
    live = stage.live()
    stage.audience.wait_until(lambda: spots_of_last(stage.audience) == 10)
    live.set_aim(Aim(mask=everywhere))
    stage.audience.wait_until(lambda: spots_of_last(stage.audience) == 0)
    live.set_aim(replace(stage.preparation.aim, mask=everywhere))
    stage.audience.wait_until(
        lambda: stage.audience.images[-1].sighting is not None,
    )

    assert spots_of_last(stage.audience) == 0


# Images


def test_a_slow_reader_is_shown_the_newest_image(stage: Stage) -> None:
    audience = stage.audience
    audience.may_go_on.clear()
    live = stage.live()
    audience.wait_until(lambda: len(audience.images) == 1)
    while live.stats.delivered < 12:
        audience.may_go_on.wait(0.001)
    audience.may_go_on.set()
    audience.wait_until(lambda: len(audience.images) >= 2)
    first, second = (image.frame.seq for image in audience.images[:2])

    assert first < 11 <= second


def test_a_swing_takes_every_image_in_order_however_slow_the_reader_is(
    stage: Stage,
) -> None:
    live = stage.live()
    live.swing(stage.swinging())
    audience = stage.audience
    audience.wait_for_phase(Phase.CAPTURING)
    n_before = len(audience.images)
    audience.wait_for_images(3)
    audience.may_go_on.clear()
    wait_until_queue_is_full(live)
    audience.may_go_on.set()
    audience.wait_for_images(40)
    seqs = [image.frame.seq for image in audience.images[n_before + 1 :]]

    assert seqs == list(range(seqs[0], seqs[0] + len(seqs)))


def wait_until_queue_is_full(live: Live) -> None:
    """Wait until a camera that waits for its reader delivers no more."""
    pause, n_delivered = threading.Event(), -1
    while live.stats.delivered > n_delivered:
        n_delivered = live.stats.delivered
        pause.wait(0.1)


def test_after_a_swing_a_recording_that_waited_for_its_reader_goes_on(
    stage: Stage, swung: Callable[..., Path]
) -> None:
    camera = ReplayCamera(
        str(swung()), loops=True, frame_rate=1000, clock=SkippingClock()
    )
    live = stage.live(camera)
    live.swing(stage.swinging())
    audience = stage.audience
    audience.wait_for_phase(Phase.CAPTURING)
    audience.may_go_on.clear()
    wait_until_queue_is_full(live)
    live.finish()
    audience.may_go_on.set()
    audience.wait_for_phase(Phase.SOLVING)
    audience.wait_for_images(20)


# A swing


def test_a_swing_goes_from_the_seat_to_its_end_without_a_wish(stage: Stage) -> None:
    live = stage.live()
    fresh = start_swing(stage.preparation.swing_setup())
    live.swing(stage.swinging(SHORT, fresh))
    audience = stage.audience
    audience.wait_for_phase(Phase.SOLVING)
    phases = list(dict.fromkeys(state.phase for state in audience.states))
    kept = [event.numbers for event in audience.happenings if is_kept(event)]

    assert phases == [
        *(Phase.WAIT, Phase.SEEN, Phase.SETTLED, Phase.COUNTDOWN, Phase.CAPTURING),
        Phase.SOLVING,
    ]
    assert kept == [(number,) for number in range(1, len(kept) + 1)]
    assert len(stage.record().images) == len(kept) >= 12
    assert audience.threads == {"looking"}


def is_kept(event: SwingEvent) -> bool:
    return event.what is Happening.KEPT


def test_nothing_is_kept_after_the_end(stage: Stage) -> None:
    live = stage.capture(3)
    live.finish()
    stage.audience.wait_for_phase(Phase.SOLVING)
    n_images, n_states = len(stage.record().images), len(stage.audience.states)
    stage.audience.wait_for_images(30)

    assert len(stage.record().images) == n_images
    assert len(stage.audience.states) == n_states


def test_a_wish_from_before_the_start_is_fulfilled(stage: Stage) -> None:
    live = stage.live(starts=False)
    live.set_aim(stage.preparation.aim)
    live.swing(stage.swinging())
    live.start()
    stage.wait_for_kept(1)


def test_a_swing_finished_at_once_has_no_images(stage: Stage) -> None:
    live = stage.live(starts=False)
    live.swing(stage.swinging())
    live.finish()
    live.start()
    stage.audience.wait_for_phase(Phase.SOLVING)

    assert stage.record().images == ()
    assert [e.what for e in stage.audience.happenings] == [Happening.CAPTURED]


def test_a_paused_swing_keeps_nothing_until_it_is_resumed(stage: Stage) -> None:
    live = stage.capture(3)
    live.pause()
    stage.audience.wait_for_phase(Phase.PAUSED)
    n_images = len(stage.record().images)
    stage.audience.wait_for_images(40)
    assert stage.audience.state.pause is Pause.BY_USER
    assert stage.audience.state.message.code == Code.PAUSED
    assert len(stage.record().images) == n_images

    live.resume()
    stage.wait_for_kept(n_images + 2)


def test_a_paused_swing_can_be_finished(stage: Stage) -> None:
    live = stage.capture(2)
    live.pause()
    live.finish()
    stage.audience.wait_for_phase(Phase.SOLVING)


def test_wishes_without_a_swing_do_nothing(stage: Stage) -> None:
    live = stage.live()
    for wish in (live.pause, live.resume, live.finish, live.abandon):
        wish()
    stage.audience.wait_for_images(5)

    assert stage.audience.states == []


def test_a_swing_keeps_its_pen_and_mask_when_others_are_looked_for(
    stage: Stage,
) -> None:
    live = stage.capture(2)
    live.set_aim(Aim(stage.preparation.camera, SAMPLE_PENS["six"]()))
    stage.wait_for_kept(6)
    live.finish()
    stage.audience.wait_for_phase(Phase.SOLVING)
    stage.audience.wait_for_images(5)
    image = stage.audience.images[-1]

    assert image.sighting is not None
    assert len(image.sighting.pixels) == 6


def test_a_recording_ends_the_swing_after_a_whole_pass_without_a_new_image(
    stage: Stage, swung: Callable[..., Path]
) -> None:
    found = open_record(swung())
    own = Preparation(
        camera_file=CameraFile.read(swung() / "camera.yaml"),
        pen_file=PenFile.read(swung() / "pen.json"),
    )
    stage.preparation = own
    live = stage.live(ReplayCamera(str(swung()), loops=True, clock=SkippingClock()))
    live.swing(stage.swinging(state=start_swing(own.swing_setup())))
    stage.audience.wait_for_phase(Phase.SOLVING)

    assert 0 < len(stage.record().images) <= len(found.images)
    assert stage.audience.happenings[-1].what is Happening.CAPTURED


# Its record


@pytest.mark.parametrize("end", ["finish", "abandon", "stop", "swing"])
def test_the_record_is_closed_however_the_swing_ends(stage: Stage, end: str) -> None:
    live = stage.capture(3)
    if end == "swing":
        live.swing(stage.swinging())
    else:
        getattr(live, end)()
    if end == "finish":
        stage.audience.wait_for_phase(Phase.SOLVING)
    elif end != "stop":
        stage.audience.wait_for_images(20)

    assert is_closed(stage.swingings[0].writer)
    assert len(stage.record().images) >= 3


def test_the_record_of_a_swing_that_never_began_is_closed(stage: Stage) -> None:
    live = stage.live(starts=False)
    live.swing(stage.swinging())
    live.stop()

    assert is_closed(stage.swingings[0].writer)


def test_what_was_wished_for_before_the_end_is_done(stage: Stage) -> None:
    live = stage.capture(2)
    live.finish()
    live.stop()

    assert stage.audience.state.phase is Phase.SOLVING
    assert live.stop_looking() is None


def test_stopping_leaves_the_swing_as_far_as_it_came(stage: Stage) -> None:
    live = stage.capture(3)
    left = live.stop_looking()

    assert left is not None
    assert left.state.phase is Phase.CAPTURING
    assert left.state.next_number == len(stage.record().images) + 1
    assert is_closed(left.writer)


def test_a_second_swing_has_a_record_of_its_own(stage: Stage) -> None:
    live = stage.capture(3)
    live.swing(stage.swinging())
    stage.audience.wait_until(lambda: stage.audience.state.n_kept == 0)
    stage.wait_for_kept(2)
    live.stop()

    assert [image.number for image in stage.record(2).images][:2] == [1, 2]
    assert len(stage.record(1).images) >= 3


def test_after_the_swing_is_abandoned_its_record_is_free(stage: Stage) -> None:
    live = stage.capture(2)
    freed = threading.Event()

    def take_over() -> None:
        with RecordWriter.resume(stage.record()) as writer:
            writer.conclude("discarded")
        freed.set()

    live.abandon(take_over)
    assert freed.wait(TIMEOUT)
    stage.audience.wait_for_images(20)

    assert stage.record().verdict == "discarded"


def test_what_fails_after_the_swing_was_abandoned_is_told(stage: Stage) -> None:
    live = stage.capture(1)

    def fail() -> None:
        raise FileError(sentence("test.trouble", "The disk is full."))

    live.abandon(fail)
    stage.audience.wait_until(lambda: len(stage.audience.troubles) == 1)
    stage.audience.wait_for_images(1)


def test_a_disk_that_is_gone_pauses_the_swing_and_costs_one_image(
    stage: Stage,
) -> None:
    live = stage.capture(3)
    images = stage.folder / "swing 1" / IMAGES
    images.rename(stage.folder / "elsewhere")
    stage.audience.wait_for_phase(Phase.PAUSED)
    n_kept = stage.audience.state.n_kept
    stage.audience.wait_until(lambda: len(stage.audience.troubles) == 1)
    assert "cannot be written" in str(stage.audience.troubles[0])
    assert stage.audience.state.pause is Pause.BY_USER

    (stage.folder / "elsewhere").rename(images)
    live.resume()
    stage.wait_for_kept(n_kept + 2)
    live.stop()
    numbers = [image.number for image in stage.record().images]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) >= n_kept + 2


# The camera


def test_the_swing_goes_on_when_a_lost_camera_is_back(stage: Stage) -> None:
    camera = stage.pen()
    live = stage.live(camera)
    live.swing(stage.swinging())
    stage.wait_for_kept(3)
    camera.faults.unplug()
    stage.audience.wait_until(lambda: Connection.LOST in connections(stage))
    camera.faults.plug_in()
    stage.wait_for_kept(stage.audience.state.n_kept + 3)

    assert connections(stage)[-1] is Connection.STREAMING


def connections(stage: Stage) -> list[Connection]:
    events = stage.audience.camera
    return [e.connection for e in events if isinstance(e, ConnectionChanged)]


def test_a_swing_waits_for_a_camera_that_is_not_there(stage: Stage) -> None:
    live = stage.live(ReplayCamera(str(stage.folder / "nothing"), loops=True))
    live.swing(stage.swinging())
    stage.audience.wait_for_phase(Phase.CAPTURING)
    stage.audience.wait_until(lambda: any(map(is_failed, stage.audience.camera)))
    assert not is_closed(stage.swingings[0].writer)

    live.finish()
    stage.audience.wait_for_phase(Phase.SOLVING)


def is_failed(event: WorkerEvent) -> bool:
    return isinstance(event, Failed)


def test_exposure_and_gain_are_set_while_images_come(stage: Stage) -> None:
    live = stage.live()
    stage.audience.wait_for_images(1)
    live.set_exposure(500.0)
    live.set_gain(6.0)
    stage.audience.wait_until(
        lambda: stage.audience.images[-1].frame.exposure_us == 500.0
    )

    assert live.caps is not None
    assert live.caps.gain_db is not None


def test_stopping_twice_or_before_the_start_does_no_harm(stage: Stage) -> None:
    stage.live(starts=False).stop()
    live = stage.live()
    live.stop()
    live.stop()


# A bug of its own


class LookingError(Exception):
    """A bug."""


@pytest.fixture
def crashed(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> Live:
    """A swing whose images could be looked at no more."""
    caught: list[BaseException | None] = []
    monkeypatch.setattr(
        "threading.excepthook", lambda args: caught.append(args.exc_value)
    )
    live = stage.capture(2)
    with monkeypatch.context() as broken:

        def fail(*_: object) -> None:
            raise LookingError

        broken.setattr("lightpen.live.looking.look", fail)
        stage.audience.wait_until(lambda: any(map(is_failed, stage.audience.camera)))
        stage.audience.wait_until(lambda: connections(stage)[-1] is Connection.CLOSED)
        live._thread.join(TIMEOUT)
    assert isinstance(caught[0], LookingError)
    return live


def test_a_bug_while_looking_counts_as_a_camera_that_failed(
    crashed: Live, stage: Stage
) -> None:
    (failed,) = (e for e in stage.audience.camera if isinstance(e, Failed))

    assert str(failed.error).endswith("Open the camera again.")


def test_after_a_bug_what_is_wished_for_is_done_at_once(
    crashed: Live, stage: Stage
) -> None:
    crashed.pause()
    assert stage.audience.state.pause is Pause.BY_USER
    freed = threading.Event()
    crashed.abandon(freed.set)

    assert freed.is_set()
    assert is_closed(stage.swingings[0].writer)


def test_after_a_bug_the_swing_is_left_as_far_as_it_came(
    crashed: Live, stage: Stage
) -> None:
    left = crashed.stop_looking()

    assert left is not None
    assert left.state.next_number == len(stage.record().images) + 1
    assert is_closed(left.writer)
