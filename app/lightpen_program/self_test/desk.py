"""The checks that need the libraries: window, fonts, records, and the whole wizard."""

import os
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QFont, QFontDatabase, QFontMetrics, QGuiApplication
from PySide6.QtWidgets import QApplication

from lightpen.cameras.clock import SkippingClock
from lightpen.detection.pen_detection import detect_pen
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.record.results.result_folder import RECORDS, RESULTS, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.names import Names
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import Preparation
from lightpen.swing.record_header import record_header
from lightpen_app.application import Wizard, has_display, make_application
from lightpen_app.crash import versions
from lightpen_app.look.theme import FAMILIES, LIGHT, apply_theme, load_fonts
from lightpen_app.work.settings import Settings
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator
from lightpen_extensions.simulator.swings import paper_camera
from lightpen_program.extensions import faces
from lightpen_program.self_test.report import SelfTestError, Tip

TICK_MS = 50
# The classes to which a platform gives fonts of its own.
CLASSES_WITH_FONTS = (
    "QAbstractItemView",
    "QHeaderView",
    "QListView",
    "QMenu",
    "QMenuBar",
    "QMessageBox",
    "QStatusBar",
    "QTableView",
    "QTreeView",
)


class Walk(QObject):
    """Opens an interrupted swing, ends it, reviews it and accepts its tip."""

    ended = Signal()  # the tip is accepted

    def __init__(self, wizard: Wizard, swing: Path) -> None:
        super().__init__(wizard)
        self._window = wizard.window
        self._workbench = wizard.workbench
        self._swing = swing
        self._next: Callable[[], bool] = self._open
        self.doing = ""  # the awaited event, and the texts of the window
        self._timer = QTimer(self, interval=TICK_MS)
        self._timer.timeout.connect(self._on_tick)

    def start(self) -> None:
        """Begin on the first page."""
        self._timer.start()

    def _on_tick(self) -> None:
        self.doing = f"{self._next.__name__}: {', '.join(self._window.words())}"
        if self._next():
            self._timer.stop()
            self.ended.emit()

    def _open(self) -> bool:
        self._workbench.run.open_requested.emit(self._swing)
        self._next = self._finish
        return False

    def _finish(self) -> bool:
        status = self._workbench.run.status
        is_whole = status.verdict is not None  # its tip was computed at once
        if self._window.page().key == "swing" and (status.is_capturing or is_whole):
            if not is_whole:
                self._workbench.run.runner.ask(lambda workflow: workflow.finish())
            self._next = self._review
        return False

    def _review(self) -> bool:
        status = self._workbench.run.status
        if status.verdict is None:
            return False
        if not status.verdict.can_be_accepted:
            raise SelfTestError(f"The tip cannot be accepted: {status.verdict}.")
        if self._window.page().key == "review":
            self._next = self._accept
        else:
            self._press_main()
        return False

    def _accept(self) -> bool:
        if self._workbench.run.status.result is not None:
            return True
        self._press_main()
        return False

    def _press_main(self) -> None:
        """Press the main button, which takes no key at once."""
        if not self._window.page().main_action().why_not:
            self._window.press_main()


N_IMAGES = 60
PERIOD = 0.1  # s from image to image
# With blanks and letters that a Windows of another language has no code page for.
NAMES = Names("Prüfstand 1", "自检", "SELF-TEST", "T-1 ä", "C-1", 10.0)
# A quarter of the usual pixels makes the test short.
SCENE = Scene(n_images=N_IMAGES, camera=paper_camera(binning=2), led_noise=0.0)


def record_swing(folder: Path, files: Path) -> None:
    """Render the images of `SCENE` and record them with their detections.

    The files of camera and pen are written to a folder. Raises `SelfTestError` if the
    pen is not found in an image.
    """
    written = write_sample_files(SCENE, files)
    preparation = Preparation(
        names=NAMES,
        camera_file=CameraFile.read(written.camera),
        pen_file=PenFile.read(written.pen),
        limits=replace(SwingLimits(), min_per_field=0),
    )
    setup = preparation.swing_setup()
    with RecordWriter.create(folder, record_header(preparation)) as writer:
        for image_plan in plan_scene(SCENE).image_plans:
            image = render_plan(SCENE, image_plan)
            seen = detect_pen(image, setup.camera, setup.pen)
            if not seen.has_pose:
                raise SelfTestError(
                    f"The pen is not found in rendered image {image_plan.index + 1}."
                )
            writer.append(
                image,
                seen.pixels,
                seen.rotation,
                seen.translation,
                image_plan.index * PERIOD,
            )


LETTERS = "Aaµ°±光笔校准"


class Desk:
    """An application with its own data folder.

    Records, results and settings are in a folder; nothing of the user's is touched.
    """

    def __init__(self, folder: Path) -> None:
        self._data = folder / "data"
        self._files = folder / "files"
        self._settings = folder / "lightpen.json"
        self._record = self._data / RECORDS / "self-test"
        self._walk: Walk | None = None
        if not has_display():
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        self._application = make_application(sys.argv[:1])

    def versions(self) -> dict[str, str]:
        """Return the versions of the program and its libraries."""
        return versions()

    def platform(self) -> str:
        """Return the name of Qt's platform plugin."""
        return QGuiApplication.platformName()

    def tested_fonts(self) -> str:
        """Return the fonts that were found to have all letters."""
        load_fonts()
        missing = set(FAMILIES) - set(QFontDatabase.families())
        if missing:
            raise SelfTestError(f"Not among the fonts: {', '.join(sorted(missing))}.")
        metrics = [QFontMetrics(QFont(family)) for family in FAMILIES]
        for letter in LETTERS:
            if not any(each.inFontUcs4(ord(letter)) for each in metrics):
                raise SelfTestError(f"The fonts have no {letter}.")
        apply_theme(self._application, LIGHT)
        for name in CLASSES_WITH_FONTS:
            # The stubs of PySide 6.11 want bytes, which the method itself refuses.
            family = QApplication.font(name).family()  # type: ignore[call-overload]
            if family != FAMILIES[0]:
                raise SelfTestError(f"{name} is shown in {family}, not {FAMILIES[0]}.")
        return ", ".join(FAMILIES)

    def tested_record(self) -> str:
        """Write a rendered swing, and read it back."""
        record_swing(self._record, self._files)
        n_images = len(open_record(self._record).images)
        if n_images != N_IMAGES:
            raise SelfTestError(f"{n_images} of {N_IMAGES} images came back.")
        return f"{n_images} images written and read back"

    def walked_wizard(self, picture: Path) -> str:
        """Have the wizard find and accept the tip of the swing; draw it at its end."""
        around = SourceEnvironment(SceneSimulator(SCENE), SkippingClock(rests=True))
        settings = Settings(self._settings)
        wizard = Wizard(self._application, faces(), settings, self._data, around)
        self._walk = walk = Walk(wizard, self._record)
        faults: list[str] = []

        def end() -> None:
            if not wizard.window.grab().save(str(picture)):
                faults.append(f"The picture {picture} cannot be written.")
            wizard.window.close()

        def give_up(
            kind: type[BaseException], error: BaseException, trace: TracebackType | None
        ) -> None:
            previous(kind, error, trace)
            faults.append(f"{kind.__name__}: {error}")
            wizard.window.close_unasked()

        previous, sys.excepthook = sys.excepthook, give_up
        walk.ended.connect(end)
        wizard.workbench.notifications.raised.connect(
            lambda text, _: faults.append(text)
        )
        wizard.show()
        wizard.started.connect(walk.start)
        try:
            self._application.exec()
        finally:
            sys.excepthook = previous
        if faults:
            raise SelfTestError(" ".join(faults))
        return "opened, finished, reviewed and accepted"

    def doing(self) -> str:
        """Return what the walk through the wizard waits for; it may run or hang."""
        return "" if self._walk is None else self._walk.doing

    def tested_result(self) -> str:
        """Return pen, folder and grade of the accepted result, which is current."""
        return f"{self._result().names.pen} in {RESULTS}, grade {self._result().grade}"

    def tip(self) -> Tip:
        """Return the tip of the accepted result, and the true one."""
        result = self._result()
        return Tip(
            result.tip_pen.tolist(), SCENE.tip_pen.tolist(), result.uncertainty.tolist()
        )

    def _result(self) -> Result:
        result = FolderArchive(self._data).in_force(
            NAMES.pen, NAMES.tip, is_simulated=True
        )
        if result is None:
            raise SelfTestError("The accepted result is not current.")
        return result
