"""The application around the window: fonts, colours, language, sounds, crash hook."""

import gc
import locale
import logging
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from types import FrameType, TracebackType
from typing import Self

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from lightpen.errors import UsageError
from lightpen.live.sources import Simulator, SourceEnvironment
from lightpen.logs import end_log, log_file, write_log_to
from lightpen.messages import printable
from lightpen_app.crash import CrashHook, versions
from lightpen_app.face import Service
from lightpen_app.faced import Face
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.sounds import Sounds, find_sounds
from lightpen_app.look.theme import apply_theme, colors_for, load_fonts
from lightpen_app.shell.main_window import LEAST_SIZE, MainWindow
from lightpen_app.shell.sidebar import subject_of
from lightpen_app.steps.start.page import StartPage
from lightpen_app.widgets.controls import open_folder
from lightpen_app.widgets.page import Page, step_titles
from lightpen_app.work.job import GarbageCollector, Job
from lightpen_app.work.settings import Preferences, Settings, data_folder, settings_file
from lightpen_app.work.workbench import Workbench

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)
TICK_MS = 100
FOLDER = "folder"  # cause of a notification


class EndSignals(QObject):
    """Handles these signals within a context.

    Python runs signal handlers between its own instructions; as there are none while Qt
    waits, a timer provides some.
    """

    # The number of the first signal, emitted from the event loop, so that nothing is
    # cut off in its midst.
    came = Signal(int)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.number = 0  # of the first signal; 0 before
        self._timer = QTimer(self, interval=TICK_MS)

        # Connections
        self._timer.timeout.connect(self._on_tick)

    def __enter__(self) -> Self:
        heard = [n for n in END_SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
        self._before = {number: signal.getsignal(number) for number in heard}
        for number in heard:
            signal.signal(number, self._note)
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._timer.stop()
        for number, handler in self._before.items():
            signal.signal(number, handler or signal.SIG_DFL)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.number = self.number or number

    def _on_tick(self) -> None:
        if self.number:
            self._timer.stop()
            self.came.emit(self.number)


def make_pages(
    workbench: Workbench, sounds: Sounds, services: Sequence[Service] = ()
) -> Iterator[Page]:
    """Make one page after the other, and import its modules only then.

    The first is painted before the others are made; those of extensions stand before
    the last.
    """
    yield StartPage(workbench, services)
    from lightpen_app.steps.camera.page import CameraPage

    yield CameraPage(workbench, sounds, services)
    from lightpen_app.steps.leds.page import LedsPage

    yield LedsPage(workbench, services)
    from lightpen_app.steps.swing.page import SwingPage

    yield SwingPage(workbench, sounds, services)
    from lightpen_app.steps.review.page import ReviewPage

    yield ReviewPage(workbench, services)
    for each in services:
        yield from each.pages(sounds)
    from lightpen_app.steps.history.page import HistoryPage

    yield HistoryPage(workbench, services)


def page_titles(services: Sequence[Service] = ()) -> tuple[str, ...]:
    """Return the titles of all pages, in their order."""
    *own, last = step_titles().values()
    return (*own, *(title for each in services for title in each.titles()), last)


# s after which a thread that computes lets the window continue. A change of theme calls
# thousands of methods, and by Python's 5 ms each would wait for the live images.
SWITCH_INTERVAL = 0.0005

SETTLED_MS = 5000  # from the start until all is made and loaded


_logger = logging.getLogger(__name__)


class Wizard(QObject):
    """The window with its workbench and services."""

    started = Signal()  # the pages are made, and the workbench has started

    def __init__(
        self,
        application: QApplication,
        faces: Sequence[Face],
        settings: Settings,
        folder: Path,
        around: SourceEnvironment | None = None,
    ) -> None:
        super().__init__(application)
        self._application = application
        self._settings = settings
        self._preferences = settings.preferences()
        self._languages = LanguageSwitch(application)
        self._languages.set_language(self._preferences.language)
        load_fonts()
        self._sounds = find_sounds(folder / "sounds")
        self._sounds.muted = self._preferences.muted
        self.workbench = Workbench(settings, folder, around, self)
        self.services = tuple(make(self.workbench) for make in faces)
        pages = iter(make_pages(self.workbench, self._sounds, self.services))
        self.window = MainWindow(
            (next(pages),),
            settings,
            self._preferences,
            self.workbench.notifications,
            pages,
            partial(page_titles, self.services),
        )
        for service in self.services:
            self.window.add_service(service)
        self.window.setMinimumSize(LEAST_SIZE)
        # Last: under a style sheet Qt styles all of a widget whenever it gets a parent,
        # which takes four times as long as to make the window.
        self._apply_appearance()
        self.workbench.live.set_watched(self.window.page().shows_images)
        self.crash_hook = CrashHook(folder / "crashes", self)

        # Connections
        self.window.closing.connect(self.workbench.shut_down)
        self.window.attention_changed.connect(self.workbench.live.set_watched)
        self.workbench.folder_watch.fault_changed.connect(self._on_folder_fault_changed)
        for model in (
            self.workbench.run,
            self.workbench.library,
            self.workbench.selection,
        ):
            model.changed.connect(self._show_subject)
        self.crash_hook.reported.connect(self._on_crash_reported)
        self.window.preferences_changed.connect(self._on_preferences_changed)
        self.window.log_requested.connect(self._open_log)
        QGuiApplication.styleHints().colorSchemeChanged.connect(self._apply_appearance)

    def show(self) -> None:
        """Show the window; once it is painted, start the workbench."""
        self.window.completed.connect(self._start)
        self.window.show()

    def _start(self) -> None:
        self.workbench.start()
        self.started.emit()

    def _show_subject(self) -> None:
        now, chosen = self.workbench.run.status, self.workbench.selection.preparation
        self.window.set_subject(
            subject_of(now, chosen, self.workbench.library.statuses)
        )

    def _on_crash_reported(self, path: str) -> None:
        """Report an internal error; path "" if no report was written."""
        text = self.tr(
            "An internal error occurred. The program can continue; all images are "
            "saved. Please send this report to the developers: {0}"
        ).format(path)
        if not path:
            text = self.tr(
                "An internal error occurred. The program can continue; all images are "
                "saved. No report was written: the disk is full or write-protected."
            )
        self.workbench.notifications.notify("crash", text)

    def _on_folder_fault_changed(self, fault: str) -> None:
        """Advise another data folder while this one cannot be written."""
        notices = self.workbench.notifications
        notices.withdraw(FOLDER)
        if fault:
            way = self.tr(
                "Choose the data folder at Set up station or in the options (F10)."
            )
            notices.notify(FOLDER, f"{fault} {way}")

    def _open_log(self) -> None:
        folder = log_file(self.workbench.folder).parent
        self.workbench.notifications.show_status(open_folder(folder))

    def _on_preferences_changed(self, preferences: Preferences) -> None:
        before, self._preferences = self._preferences, preferences
        self._settings.set_preferences(preferences)
        self._sounds.muted = preferences.muted
        if preferences.language != before.language:
            self._languages.set_language(preferences.language)
        if preferences.appearance is not before.appearance:
            self._apply_appearance()

    def _apply_appearance(self) -> None:
        scheme = QGuiApplication.styleHints().colorScheme()
        colors = colors_for(self._preferences.appearance, scheme)
        apply_theme(self._application, colors)


def make_application(arguments: Sequence[str]) -> QApplication:
    """Return the QApplication of the program."""
    sys.setswitchinterval(SWITCH_INTERVAL)
    QApplication.setStyle("Fusion")
    # PySide crashes at an argument that is no text, as a path may be.
    application = QApplication([printable(argument) for argument in arguments])
    application.setApplicationName("lightpen")
    application.setApplicationDisplayName("Lightpen")
    # Qt has set the locale; with Turkish letters PySide finds no property by keyword.
    locale.setlocale(locale.LC_CTYPE, "C")
    GarbageCollector(application)
    return application


def run(
    faces: Sequence[Face], simulator: Simulator | None, swing: Path | None = None
) -> int:
    """Show the wizard until its window closes, and return the exit status.

    The swing is shown, see `lightpen.record.results.result_folder`. Raises `UsageError`
    if there is no display.
    """
    if not has_display():
        raise UsageError("application.no-display")
    application = make_application(sys.argv)
    with EndSignals(application) as signals:
        settings = Settings(settings_file())
        folder = data_folder(settings.preferences())
        write_log_to(folder)
        _logger.info("window with the data folder %s", folder)
        around = SourceEnvironment(simulator)
        wizard = Wizard(application, faces, settings, folder, around)
        log_versions = Job(lambda _: _logger.info("versions: %s", versions()), wizard)
        QTimer.singleShot(SETTLED_MS, log_versions.start)
        if swing is not None:
            open_swing = partial(wizard.workbench.run.open_requested.emit, swing)
            wizard.started.connect(open_swing)
        status = shown_until_closed(application, wizard, signals)
    return ended(wizard, status)


def required(simulator: Simulator | None) -> Simulator:
    """Return the simulator; raises `UsageError` without one."""
    if simulator is None:
        raise UsageError("application.no-simulator")
    return simulator


def has_display() -> bool:
    """Return whether a window can be shown, or a platform without one is chosen."""
    if not sys.platform.startswith("linux"):
        return True
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return any(os.environ.get(name) for name in names)


def shown_until_closed(
    application: QApplication, wizard: Wizard, signals: EndSignals
) -> int:
    """Show the window until it closes; return the exit status."""
    signals.came.connect(lambda: _end(application, wizard))
    wizard.crash_hook.install()
    wizard.show()
    QTimer.singleShot(SETTLED_MS, gc.freeze)  # no search goes through the window again
    try:
        status = application.exec()
    finally:
        wizard.crash_hook.remove()
    # Shells expect 128 plus the number of the signal. What `exit` is given does not
    # reach `exec` where the last window closes while a question is open.
    return 128 + signals.number if signals.number else status


def _end(application: QApplication, wizard: Wizard) -> None:
    wizard.window.close_unasked()
    application.exit()


def ended(wizard: Wizard, status: int) -> int:
    """Return the exit status, but end the process where something has not ended.

    Qt and OpenBLAS wait at the end of a process for their threads, without end for one
    that is stuck, as in a write to a disk that does not answer. What was acknowledged
    is on the disk, as after any kill.
    """
    if not wizard.workbench.shut_down(0.0):
        _logger.warning("something has not ended; the process is")
        end_log()
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:  # as it is without a console on Windows
                stream.flush()
        os._exit(status)
    return status
