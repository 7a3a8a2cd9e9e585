"""Panel of the LED file: open it, read it again, and what is wrong with it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QFileSystemWatcher, QTimer, Signal
from PySide6.QtWidgets import QFileDialog, QLabel, QWidget

from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_tables import UNITS
from lightpen.messages import Message
from lightpen.model.pen import Pen
from lightpen.pen_check.frame import OpenedPen, open_pen, save_pen
from lightpen.swing.preparation import Preparation, SourceKind
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.controls import FileDrops, ask_file, give_focus
from lightpen_app.widgets.fields import ChoiceField, PathField, Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.workbench import Workbench

REREAD_MS = 500  # until a program that saves a file has written it whole


class LedFilePanel(Translated, QWidget):
    """Opens the files that are chosen, and again once they have changed."""

    changed = Signal()  # `opened` is another
    discovery_requested = Signal()  # no such file: find the LEDs by a swing

    def __init__(self, workbench: Workbench, *, can_discover: bool = True) -> None:
        super().__init__()
        self._selection, self._pens = workbench.selection, workbench.pens
        self._notices = workbench.notifications
        self._unit_asked = ""
        self._opened: OpenedPen | None = None
        self._refusal: Callable[[], str] = str
        self._job = LatestJob(self)
        self._watcher = QFileSystemWatcher(self)
        self._is_stale = False  # the file has changed
        self._waiting = QTimer(self, singleShot=True, interval=REREAD_MS)

        # Widgets
        label = self.say(QLabel(), self.tr("LED &file"))
        self._path = self.say(
            PathField(),
            hint=self.tr("Table (CSV) or JSON file"),
            name=self.tr("LED file"),
        )
        self._path.add_button(
            self.make_button(self.tr("Open..."), self._on_open_clicked)
        )
        self._samples = self.make_button(
            self.tr("Use file of the simulated pen"), workbench.files.use_samples
        )
        self._discover = self.make_button(
            self.tr("I have no such file..."),
            self.discovery_requested,
            tip=self.tr("Find pen, camera and tip by one swing and one length."),
        )
        self._discover.setVisible(can_discover)
        label.setBuddy(self._path.edit)
        self._units_row = QWidget()
        self._units_words = SignLabel(wraps=False)
        self._units = self.say(ChoiceField(), self.tr("Unit of the file"))
        self._units.addItems(["", *UNITS])
        self._problem = SignLabel()
        self.question = QuestionBar()

        # Layout
        layout = vertical_layout(self)
        self._row = horizontal_layout(layout)
        horizontal_layout(self._row, label, (self._path, 1), stretch=1)
        horizontal_layout(self._row, self._samples, self._discover)
        horizontal_layout(
            self._units_row, self._units_words, self._units, 1, spacing=2 * GRID
        )
        self._units_row.hide()
        for each in (self._units_row, self._problem, self.question):
            layout.addWidget(each)

        # Connections
        self._path.path_chosen.connect(lambda path: self._open(Path(path)))
        FileDrops(self).dropped.connect(self._path.accept)
        self._units.textActivated.connect(self._on_units_chosen)
        self.question.declined.connect(self._on_declined)
        self._selection.changed.connect(self._on_selection_changed)
        self._selection.station_changed.connect(self._on_station_changed)
        self._watcher.fileChanged.connect(self._on_file_changed)
        self._waiting.timeout.connect(self.reread)

        self._on_selection_changed()

    def set_narrow(self, narrow: bool) -> None:
        """Place the buttons below the path, or beside it."""
        set_stacked(self._row, narrow)

    def ask_units(self, name: str) -> None:
        """Ask for missing units; an empty text ends the question."""
        self._unit_asked = name
        self._units.setCurrentIndex(0)
        self._refresh()
        self._units_row.setVisible(bool(name))
        if name:
            give_focus(self._units)

    def ask(
        self, words: Callable[[], tuple[str, str]], agreed: Callable[[], object]
    ) -> None:
        """Ask before ``agreed`` is called.

        ``words`` returns the question, and what agrees to it.
        """
        cancel = self.tr("Cancel")
        self.question.ask_about(lambda: Question(*words(), cancel), agreed)

    def _on_open_clicked(self) -> None:
        self._path.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("LEDs of the pen"),
            self.tr("LEDs of a pen ({0})").format("*.csv *.txt *.json *.xlsx *.yaml"),
        )

    def _on_units_chosen(self, units: str) -> None:
        if units:
            self._open(Path(self._path.value()), units)

    def _on_declined(self) -> None:
        self.ask_units("")
        self._show_path()

    def _refresh(self) -> None:
        words = self.tr("{0} does not state the unit of its coordinates. Choose it:")
        self._units_words.set_value(
            StatusMessage.warning(words.format(self._unit_asked))
        )
        refusal = self._refusal()
        self._path.set_faulty(bool(refusal))
        self._problem.set_value(StatusMessage.fault(refusal))
        source = self._selection.preparation.source
        self._samples.setVisible(source.kind == SourceKind.SIMULATED)

    @property
    def opened(self) -> OpenedPen | None:
        """The file in use; without one, one that cannot be used."""
        return self._opened

    def reread(self) -> None:
        """Open the file again if it has changed and the page is shown."""
        opened = self._opened
        if self._is_stale and opened is not None and self.isVisible():
            file = opened.file
            self._watch()
            self._open(opened.path, None if file is None else file.units)

    def ask_place(self, pen: Pen) -> None:
        """Let the user choose the file for a corrected pen, which is then in use."""
        assert self._opened is not None
        path = self._opened.path
        ask_file(
            self,
            self.tr("Save the corrected LEDs"),
            path.with_name(self.tr("{0} corrected").format(path.stem) + ".json"),
            partial(self.save, pen),
        )

    def save(self, pen: Pen, path: Path) -> None:
        """Write a pen to a JSON file, and use that."""
        self._start(lambda _: save_pen(pen, path), self._on_saved)

    def _open(self, path: Path, units: str | None = None) -> None:
        self._notices.show_status("")
        self.ask_units("")
        self._start(lambda _: open_pen(path, units), self._on_opened)

    def _start(
        self, read: Callable[[Report], OpenedPen], take: Callable[[OpenedPen], None]
    ) -> None:
        self._is_stale = False
        self._job.start(
            read, take, lambda sentence: self._set_problem(lambda: sentence)
        )

    def _on_opened(self, opened: OpenedPen) -> None:
        if opened.file is not None and self._pens.doubt_about(opened.file):
            words = partial(self._doubt_question, opened.file)
            self.ask(words, partial(self._use, opened.file))
        elif opened.file is not None:
            self._use(opened.file)
        elif opened.pen is not None:
            self._show(opened)
            now = self._selection.preparation
            self._selection.set_preparation(replace(now, pen_file=None))
        elif opened.needs_units:
            self._set_problem(str)
            self.ask_units(opened.path.name)
        else:
            self._set_problem(partial(self._refused, opened.problem))

    def _on_saved(self, opened: OpenedPen) -> None:
        if opened.file is None:
            self._on_opened(opened)
            return
        self._use(opened.file)
        words = self.tr("LEDs saved as {0} and in use.")
        self._notices.show_status(words.format(opened.path.name))

    def _use(self, file: PenFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(replace(now, pen_file=file))
        self._pens.keep(file)
        self._set_problem(str)

    def _show(self, opened: OpenedPen | None) -> None:
        self._opened = opened
        self._watch()
        self.ask_units("")
        self._show_path()
        problem = None if opened is None else opened.problem
        self._set_problem(partial(worded, problem))
        self.changed.emit()

    def _set_problem(self, problem: Callable[[], str]) -> None:
        """Show a message on the file in the selected language."""
        self._refusal = problem
        self._refresh()

    def _doubt_question(self, file: PenFile) -> tuple[str, str]:
        words = self.tr("{0} Use it for this pen from now on?")
        text = words.format(self._pens.doubt_about(file))
        return text, self.tr("Use this file")

    def _refused(self, why: Message | None) -> str:
        """Return why a file cannot be opened, and which one is open."""
        if self._opened is None:
            return worded(why)
        kept = self.tr("{0} remains open.").format(self._opened.path.name)
        return f"{worded(why)} {kept}"

    def _show_path(self) -> None:
        self._path.set_value("" if self._opened is None else str(self._opened.path))

    def _watch(self) -> None:
        """Watch the open file, also one that has been put in place of another."""
        if self._watcher.files():
            self._watcher.removePaths(self._watcher.files())
        if self._opened is not None:
            self._watcher.addPath(str(self._opened.path))

    def _on_file_changed(self) -> None:
        self._is_stale = True
        self._waiting.start()

    def _on_selection_changed(self, before: Preparation | None = None) -> None:
        self._refresh()
        file, shown = self._selection.preparation.pen_file, self._opened
        in_use = None if shown is None else shown.file
        if file is not in_use or before is None:
            self._show(None if file is None else OpenedPen.of(file))

    def _on_station_changed(self) -> None:
        self._job.cancel()
        if self._opened is not None and self._opened.file is None:
            self._show(None)
