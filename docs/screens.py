"""Draw the steps of the wizard: ``python docs/screens.py [--all FOLDER]``.

Writes docs/screens/<step>-<language>-<appearance>-<width>x<height>.png, the pictures
of README.md. The tests draw them again and compare, so run this after a wanted change
of the look, and look at each. With ``--all`` every step is drawn in all languages,
appearances and sizes; pictures already in the folder, say of the commit before,
are compared and replaced, and those that differ are named. What the wizard shows is
simulated, with fixed seeds and without a running camera, so that the pictures are the
same each time.
"""

import argparse
import gc
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import reduce
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NoReturn, TypeAlias, TypeVar

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

sys.path.append(str(Path(__file__).parents[1]))

import cv2
import numpy as np
import numpy.typing as npt
from benchmarks.small_records import small_record
from msgspec import structs
from PySide6.QtCore import QDeadlineTimer, QEvent, QSize, QThreadPool, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from tests.simulated_centers import simulate_centers
from typing_extensions import override

from lightpen.archive.chains import Event, Kind, append
from lightpen.cameras.protocol import CameraSettings, Frame, FrameTimeout, Stats, sealed
from lightpen.detection.pen_detection import detect_from_centers, detect_pen
from lightpen.estimation.reports.verdict import Grade
from lightpen.live.pipeline import LiveImage
from lightpen.live.sources import SourceEnvironment
from lightpen.messages import message
from lightpen.model.names import Origin
from lightpen.record.results.result_folder import RECORDS, SIMULATED, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.rules import advance_swing
from lightpen.swing.capture.state import SwingSetup, SwingState, start_swing
from lightpen.swing.preparation import Preparation, SourceChoice
from lightpen.swing.swing_recorder import read_resumable, record_header
from lightpen_app.application import Wizard, make_application
from lightpen_app.look.figures import pooled
from lightpen_app.look.theme import GRID, Appearance
from lightpen_app.steps.history.history_table import HistoryTable
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.settings import Preferences, Settings
from lightpen_app_extensions.measure.service import MeasureService, VerificationRun
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    advance_session,
)
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import HandGoal, VerificationChoices
from lightpen_extensions.simulator.camera import (
    GuidedOperator,
    SimulatedCamera,
    SkippingClock,
)
from lightpen_extensions.simulator.hand import (
    SimulatedOperator,
    lean_vectors,
    postures_of,
)
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator
from lightpen_program.extensions import faces
from lightpen_resources import languages

Seen = TypeVar("Seen")

FOLDER = Path(__file__).resolve().parent / "screens"
DATA = Path("lightpen")  # below the present folder
STEPS = ("start", "camera", "leds", "swing", "review", "verify", "measure", "history")
SIZES = (QSize(1280, 800), QSize(1920, 1080))
BALL = 10.0  # mm
NAMES = Names("Hall 2", "A. Weber", "LP-04", "T-10-80", "C-1", BALL)
NOW = datetime.fromisoformat("2026-09-30T10:00:00+02:00")
SIGMA = 0.05  # px, of the centres in the swing
PERIOD = 0.05  # s
N_KEPT = 60  # when the swing is drawn
N_RECORDED = 60  # images that are reviewed
N_SHOWN = 40  # live images that a page is shown
N_RECEIVED = 1240  # images, by the camera
CHOICES = VerificationChoices(n_cone_frames=10)
PART_CHOICES = VerificationChoices(
    plan=plate_plan().limited_to({"top", "hole 1", "dome"})
)
N_TOUCHED = 4  # points of a verification that is under way
N_HELD = 16  # images through which the pen is held still
N_EARLIER = 24  # calibrations in the history
REFRESH_MS = 200  # of the plots
COMPARING_MS = 1500  # after which the LEDs of the file were compared with the images
VISIBLE = 32  # of 255 levels; other versions of a font renderer shade edges by less
SQUARE = 64  # px, in which pixels that differ are counted
MAX_SHARE = 0.02  # of the pixels of a square: a short word of the smallest size
PAUSE = 0.01  # s between two looks at what is waited for
PATIENCE_MS = 120_000  # of all that is waited for, on a machine that does other things


@dataclass(frozen=True)
class Look:
    """How the wizard is drawn."""

    language: str
    appearance: Appearance
    size: QSize

    def file_name(self, step: str) -> str:
        """Return the name of the picture of a step."""
        size = f"{self.size.width()}x{self.size.height()}"
        return f"{step}-{self.language}-{self.appearance}-{size}.png"


def published_looks(step: str) -> tuple[Look, ...]:
    """Return the looks of a step that are in the repository."""
    if step != "swing":
        return (Look("en", Appearance.LIGHT, SIZES[0]),)
    return (
        Look("en", Appearance.DARK, SIZES[0]),
        Look("zh_CN", Appearance.LIGHT, SIZES[0]),
    )


def all_looks(step: str) -> tuple[Look, ...]:
    """Return all looks of a step in the order of drawing.

    One appearance after the other, the last one of the step before first: a change of
    appearance takes long.
    """
    appearances = (Appearance.DARK, Appearance.LIGHT)
    return tuple(
        Look(language, appearance, size)
        for appearance in appearances[:: 1 if STEPS.index(step) % 2 else -1]
        for language in languages()
        for size in SIZES
    )


Looks: TypeAlias = Callable[[str], tuple[Look, ...]]


def look_before(step: str, looks: Looks) -> Look:
    """Return the look in which a step is opened, and from which it is drawn."""
    return replace(all_looks(step)[-1], appearance=looks(step)[0].appearance)


@dataclass(frozen=True, eq=False)
class Difference:
    """How far two pictures differ.

    Attributes
    ----------
    share : float
        Largest share of visibly different pixels in a square.
    picture : QImage
        These pixels in white.
    """

    share: float
    picture: QImage

    @property
    def is_seen(self) -> bool:
        """Whether the content differs, not only its antialiasing."""
        return self.share > MAX_SHARE


class StillCamera(SimulatedCamera):
    """A simulated camera that is open and sends nothing by itself."""

    @override
    def read(self, timeout_s: float) -> NoReturn:
        threading.Event().wait(timeout_s / 20)
        raise FrameTimeout(message("file.image"))

    @override
    def stats(self) -> Stats:
        return Stats(delivered=N_RECEIVED)


class Stage:
    """The wizard in a folder of its own, shown step by step."""

    def __init__(self, application: QApplication) -> None:
        self._application = application
        application.setCursorFlashTime(0)  # a cursor that blinks is not the same twice
        self._scene = Scene(n_images=N_SHOWN)
        self._looked_at: dict[int, DisplayedImage] = {}
        self._image_plans = plan_scene(self._scene).image_plans
        settings = Settings(DATA / "lightpen.json")
        settings.set_preferences(Preferences())
        FolderArchive(DATA).store(_earlier_result())
        simulator = SceneSimulator(self._scene)
        around = SourceEnvironment(simulator, SkippingClock(), lambda: NOW, tuple)
        self.wizard = Wizard(application, faces(), settings, DATA, around)
        self.wizard.window.pages()  # they follow what is chosen below
        workbench = self._workbench = self.wizard.workbench
        (self._measure,) = (
            each for each in self.wizard.services if isinstance(each, MeasureService)
        )
        files = simulator.write_files(DATA / SIMULATED)
        workbench.selection.set_preparation(
            replace(
                workbench.selection.preparation,
                names=NAMES,
                camera_file=files.camera_file,
                pen_file=files.pen_file,
                source=SourceChoice(),
            )
        )
        workbench.live.open(
            [StillCamera(self._scene, around.clock)], CameraSettings(), around.clock
        )
        self.wizard.window.show()

    def close(self) -> None:
        """Close the window without a question, and leave no widget of it."""
        self._workbench.run.runner.ask(lambda workflow: workflow.abandon())
        window = self.wizard.window
        window.close_unasked()
        others = window.operator_view, window.help_window
        for each in (*others, window, self.wizard):
            each.deleteLater()
        self._settle()
        gc.collect()  # what is left of its widgets, on no other thread

    def set_look(self, detect_pen: Look) -> None:
        """Change language, colours and size."""
        self.wizard.window.preferences_changed.emit(
            Preferences(detect_pen.language, detect_pen.appearance)
        )
        # Wrapped words are laid out by what was there before; one more change of the
        # size makes that always the same.
        with self.unpainted():
            self.wizard.window.resize(detect_pen.size + QSize(GRID, GRID))
            self._settle()
        self.wizard.window.resize(detect_pen.size)
        self._settle()

    @contextmanager
    def unpainted(self) -> Iterator[None]:
        """Lay out the window without painting it, which takes longest."""
        window = self.wizard.window
        before = window.updatesEnabled()
        window.setUpdatesEnabled(False)
        try:
            yield
        finally:
            window.setUpdatesEnabled(before)

    def go_to(self, step: str) -> None:
        """Go to a step and fill it."""
        self.wizard.window.show_step(step)
        self._settle()
        getattr(self, f"_fill_{step}")()
        self._settle()

    def picture(self) -> QImage:
        """Return the window as it is, as soon as nothing moves in it any more."""
        return self.still(self._grabbed)

    def still(self, detect_pen: Callable[[], Seen]) -> Seen:
        """Return what a look shows, as soon as it shows the same twice.

        What a page shows after a moment, however late that is, comes before.
        """
        before, now = None, detect_pen()
        deadline = QDeadlineTimer(PATIENCE_MS)
        while now != before:
            if deadline.hasExpired():
                raise TimeoutError("The page does not come to rest.")
            self._wait_until(lambda: not self._is_about_to_change())
            before, now = now, detect_pen()
        return now

    def _is_about_to_change(self) -> bool:
        timers = self.wizard.window.page().findChildren(QTimer)
        return any(timer.isActive() and timer.isSingleShot() for timer in timers)

    def _grabbed(self) -> QImage:
        image = self.wizard.window.grab().toImage()
        return image.convertToFormat(QImage.Format.Format_RGB888)

    def _fill_start(self) -> None:
        self.wizard.window.page().entered()
        _await_jobs()

    def _fill_camera(self) -> None:
        for index in range(N_SHOWN):
            self._show_image(index)

    def _fill_leds(self) -> None:
        for index in range(N_SHOWN):
            self._show_image(index)
        compared = QDeadlineTimer(COMPARING_MS)
        self._wait_until(compared.hasExpired)
        _await_jobs()

    def _fill_swing(self) -> None:
        selection, run = self._workbench.selection, self._workbench.run
        swing = _swing(selection.preparation.swing_setup(), self._scene)
        heading = swing.heading  # kept for the next swings, as by a real one
        selection.set_preparation(replace(selection.preparation, heading=heading))
        chosen = selection.preparation
        run.runner.ask(lambda workflow: workflow.begin(chosen))
        self._wait_until(lambda: run.status.state is not None)
        run.on_swing(replace(run.status, state=swing), ())
        for index in range(N_SHOWN):
            self._show_image(index)
        refreshed = QDeadlineTimer(2 * REFRESH_MS)
        self._wait_until(refreshed.hasExpired)
        if run.status.state is not swing:
            raise RuntimeError("The page does not show the swing.")

    def _fill_review(self) -> None:
        _await_jobs()

    def _fill_verify(self) -> None:
        run = self._workbench.run
        run.runner.ask(
            lambda workflow: workflow.solving.accept("The station is being set up.")
        )
        self._wait_until(lambda: run.status.result is not None)
        self._fill_probing(self._measure.verification, CHOICES, _touched)

    def _fill_measure(self) -> None:
        self._fill_probing(self._measure.measuring, PART_CHOICES, _measured)

    def _fill_probing(
        self,
        probing: VerificationRun,
        choices: VerificationChoices,
        probed: Callable[[SessionSetup, Scene], SessionState],
    ) -> None:
        self._measure.set_choices(choices)
        probing.runner.ask(lambda workflow: workflow.start_over())
        self._wait_until(lambda: probing.status.is_touching)
        before = probing.status
        assert before.setup is not None
        probing.runner.ask(lambda workflow: workflow.note_departure())
        self._wait_until(lambda: not probing.status.is_here)
        state = probed(before.setup, self._scene)
        status = replace(
            probing.status, tip=before.tip, setup=before.setup, state=state
        )
        probing.on_verification(status, ())
        for index in range(N_SHOWN):
            self._show_image(index)
        shown = QDeadlineTimer(REFRESH_MS)
        self._wait_until(shown.hasExpired)

    def show_otherwise(self, step: str) -> None:
        """Show another moment of a probing step: all results, or the first points."""
        is_verified = step == "verify"
        probing = self._measure.verification if is_verified else self._measure.measuring
        status = probing.status
        assert status.setup is not None
        probed = _verified if is_verified else _measuring
        state = probed(status.setup, self._scene)
        probing.on_verification(replace(status, state=state), ())
        shown = QDeadlineTimer(REFRESH_MS)
        self._wait_until(shown.hasExpired)

    def _fill_history(self) -> None:
        logbook = self._workbench.run.logbook.opened()
        for n in range(N_EARLIER):
            append(logbook.database, logbook.chain, _earlier_calibration(n))
        self.wizard.window.page().entered()
        self._wait_until(lambda: self._n_shown() >= N_EARLIER)
        _await_jobs()
        self._settle()
        _await_jobs()  # of the trend, which follows

    def _n_shown(self) -> int:
        table = self.wizard.window.page().findChild(HistoryTable)
        return table.model().rowCount() if isinstance(table, HistoryTable) else 0

    def solve(self) -> None:
        """Record a swing and solve it, so that the review opens."""
        run = self._workbench.run
        folder = run.records_folder / "20260930-095900_LP-04_T-10-80"
        _record(folder, self._workbench.selection.preparation)
        resumable = read_resumable(folder)
        run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        run.runner.ask(lambda workflow: workflow.finish())
        self._wait_until(lambda: run.status.solution is not None)

    def _show_image(self, index: int) -> None:
        if index not in self._looked_at:
            self._looked_at[index] = self._looked(index)
        self._workbench.live.image_shown.emit(self._looked_at[index])
        self._settle()

    def _looked(self, index: int) -> DisplayedImage:
        image = sealed(render_plan(self._scene, self._image_plans[index]))
        frame = Frame(image, seq=index, host_ts_ns=round(index * PERIOD * 1e9))
        now = self._workbench.selection.preparation
        assert now.camera is not None
        assert now.pen is not None
        detection = detect_pen(image, now.camera, now.pen, now.mask)
        assert detection.spots is not None
        height, width = image.shape
        seen = LiveImage(frame, detection.spots, detection)
        return DisplayedImage(pooled(image), QSize(width, height), seen)

    def _wait_until(self, condition: Callable[[], bool]) -> None:
        self._settle()
        deadline = QDeadlineTimer(PATIENCE_MS)
        while not condition():
            if deadline.hasExpired():
                raise TimeoutError("What is waited for does not come.")
            time.sleep(PAUSE)  # the work that is waited for needs the processor, too
            self._settle()

    def _settle(self) -> None:
        self._application.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        self._application.processEvents()


def walk(stage: Stage, looks: Looks) -> Iterator[str]:
    """Go through the steps, and yield each."""
    for step in STEPS:
        stage.set_look(look_before(step, looks))  # the first layout depends on it
        if step == "review":
            stage.solve()
        stage.go_to(step)
        yield step


def draw(stage: Stage, step: str, looks: Looks) -> Iterator[tuple[str, QImage]]:
    """Yield name and picture of the present step in every look."""
    stage.set_look(look_before(step, looks))
    for each in looks(step):
        stage.set_look(each)
        yield each.file_name(step), stage.picture()


def _await_jobs() -> None:
    if not QThreadPool.globalInstance().waitForDone(PATIENCE_MS):
        raise TimeoutError("A job does not end.")


def _earlier_result() -> Result:
    return Result(
        names=NAMES,
        accepted=NOW - timedelta(days=12),
        grade=Grade.PASS,
        record=DATA / RECORDS / "20260918-095512_LP-04_T-10-80",
        images=(),
        calibration=small_record(
            {
                "tip_pen_mm": [-1.3179, -90.4102, -23.8551],
                "expanded_uncertainty_mm": [0.0011, 0.0024, 0.0017],
                "cone_cam_mm": [0.0, 0.0, 1000.0],
                "covariance": np.diag(6 * [0.001**2]).tolist(),
            }
        ),
        origin=Origin.SIMULATED,
    )


def _earlier_calibration(n: int) -> Event:
    """Return an entry of a tip that was calibrated twice a month."""
    rng = np.random.default_rng(n)
    uncertainty = rng.uniform(0.004, 0.009)
    tip = np.array([-1.3179, -90.4102, -23.8551]) + rng.normal(0.0, 0.002, 3)
    return Event(
        kind=Kind.ACCEPTED,
        at=NOW - timedelta(days=15 * (N_EARLIER - n)),
        names=NAMES,
        program="lightpen",
        origin=Origin.LIVE,
        grade=Grade.PASS,
        tip_pen_mm=tuple(tip.tolist()),
        expanded_uncertainty_mm=(0.7 * uncertainty, 0.8 * uncertainty, uncertainty),
        settings={"max_uncertainty_mm": 0.012},
    )


def _swing(setup: SwingSetup, scene: Scene) -> SwingState:
    """Return a swing in the middle of its capture."""
    clock = SkippingClock()
    operator = SimulatedOperator(clock, scene.seed, seated=True)
    follower = GuidedOperator(operator)
    rng = np.random.default_rng(scene.seed)
    state = start_swing(setup)
    while state.n_kept < N_KEPT:
        clock.wait(PERIOD)
        now = clock.now_ns() * 1e-9
        held = operator.held(np.array([now]))
        R = held.postures.rotations
        t = scene.cone_cam + held.offsets - R @ scene.tip_pen
        pixels = simulate_centers(scene.camera, scene.pen, R, t, SIGMA, rng)
        detection = detect_from_centers(scene.camera, scene.pen, pixels[0], R[0], t[0])
        state = advance_swing(setup, state, detection, now).state
        follower.follow(state)
    return state


def _touched(
    setup: SessionSetup, scene: Scene, n_touches: int = N_TOUCHED
) -> SessionState:
    """Return a verification after some points in the cone."""
    goals = [FIXED_POINT.hand(setup.choices, 0, i) for i in range(n_touches)]
    return _probed(setup, scene, [replace(goal, point=np.zeros(3)) for goal in goals])


def _verified(setup: SessionSetup, scene: Scene) -> SessionState:
    """Return a verification with its result."""
    return _touched(setup, scene, setup.choices.n_cone)


def _measuring(setup: SessionSetup, scene: Scene) -> SessionState:
    """Return a part in the middle of its second feature."""
    return _measured(setup, scene, n_points=9)


def _measured(
    setup: SessionSetup, scene: Scene, n_points: int | None = None
) -> SessionState:
    """Return a part with all its features, or after the first points."""
    return _probed(
        setup,
        scene,
        [
            PART.hand(setup.choices, run, i)
            for run, feature in enumerate(setup.choices.features)
            for i in range(feature.n_touches)
        ][:n_points],
    )


def _probed(
    setup: SessionSetup, scene: Scene, goals: Sequence[HandGoal]
) -> SessionState:
    """Return a session after points, at which the pen is held in the air."""
    rng = np.random.default_rng(scene.seed)
    state = SessionState()
    for goal in goals:
        assert goal.point is not None
        point = goal.point + BALL / 2 * goal.outwards
        tilt = 0.1 if goal.tilt == 0 else goal.tilt
        R = postures_of(lean_vectors(tilt, goal.direction, 0.0)[None]).rotations
        t = scene.cone_cam + point - R @ scene.tip_pen
        for _ in range(N_HELD):
            (pixels,) = simulate_centers(scene.camera, scene.pen, R, t, SIGMA, rng)
            detection = detect_from_centers(scene.camera, scene.pen, pixels, R[0], t[0])
            state = advance_session(setup, state, "image", detection).state
    return state


def _record(folder: Path, preparation: Preparation) -> None:
    """Write the record of a swing."""
    scene = Scene(n_images=N_RECORDED, seed=3)
    header = structs.replace(record_header(preparation), created=NOW)
    with RecordWriter.create(folder, header) as writer:
        for index, image_plan in enumerate(plan_scene(scene).image_plans):
            image = render_plan(scene, image_plan)
            seen = detect_pen(image, scene.camera, scene.pen)
            writer.append(
                image, seen.pixels, seen.rotation, seen.translation, index * PERIOD
            )


@contextmanager
def anywhere() -> Iterator[None]:
    """Make an empty folder the present one, and UTC the time, for a while."""
    before = os.environ.get("TZ")
    os.environ["TZ"] = "UTC"
    time.tzset()
    try:
        with TemporaryDirectory() as folder, chdir(folder):
            yield
    finally:
        del os.environ["TZ"]
        if before is not None:
            os.environ["TZ"] = before
        time.tzset()


def levels(image: QImage) -> npt.NDArray[np.uint8]:
    """Return (H, W, 3) levels of red, green and blue."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), -1)
    return rows[:, : 3 * rgb.width()].reshape(rgb.height(), -1, 3).copy()


def compare(actual: QImage, expected: QImage) -> Difference:
    """Compare two pictures."""
    if actual.size() != expected.size():
        return Difference(1.0, actual)
    differences = cv2.absdiff(levels(actual), levels(expected))
    apart = reduce(cv2.max, cv2.split(differences)) > VISIBLE
    shown = np.where(apart, 255, 0).astype(np.uint8)
    height, width = shown.shape
    grey = QImage.Format.Format_Grayscale8
    picture = QImage(shown.tobytes(), width, height, width, grey).copy()
    square = (SQUARE, SQUARE)
    shares = cv2.blur(apart.astype(np.float32), square, borderType=cv2.BORDER_CONSTANT)
    return Difference(float(shares.max()), picture)


def main() -> None:
    """Draw the pictures of the repository, or all of them."""
    parser = argparse.ArgumentParser(description="Draw the steps of the wizard.")
    parser.add_argument("--all", type=Path, metavar="FOLDER", help="draw all looks")
    options = parser.parse_args()
    folder = FOLDER if options.all is None else options.all.absolute()
    looks = published_looks if options.all is None else all_looks
    folder.mkdir(parents=True, exist_ok=True)
    application = make_application(sys.argv[:1])
    with anywhere():
        stage = Stage(application)
        for step in walk(stage, looks):
            for name, picture in draw(stage, step, looks):
                before = QImage(str(folder / name))
                if not before.isNull() and compare(picture, before).is_seen:
                    print(f"{name} has changed")
                picture.save(str(folder / name))
        stage.close()


if __name__ == "__main__":
    main()
