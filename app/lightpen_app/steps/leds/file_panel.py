"""Panel of the LED file: open, save as, and the reason for failures."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QFileDialog, QLabel, QWidget

from lightpen.formats.opened_files import PenFile
from lightpen.formats.pen_tables import UNITS
from lightpen.messages import Message
from lightpen.pen_check.draft import (
    OpenedPen,
    PenDraft,
    leds_to_exchange,
    open_pen,
    save_pen,
)
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.leds.draft import (
    LedDraft,
    LedState,
    unsaved_leds_text,
    why_not_savable,
)
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.controls import FileDrops, PushButton, give_focus
from lightpen_app.widgets.fields import ChoiceField, PathField, Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app.work.library_watch import PenFiles


class LedFilePanel(Translated, QWidget):
    """Path and buttons, with messages and questions about the file."""

    path_chosen = Signal(str)  # path of the file to open
    # The path of a file that does not say its units, and the units.
    units_chosen = Signal(str, str)
    # Path of the file to write; an existing file may be replaced.
    save_chosen = Signal(object)
    samples_requested = Signal()  # use the file of the simulated pen
    exchange_requested = Signal(object)  # pair of int: numbers of two LEDs to swap
    discovery_requested = Signal()  # no such file: find the LEDs by a swing

    def __init__(
        self, parent: QWidget | None = None, *, can_discover: bool = True
    ) -> None:
        super().__init__(parent)
        self._value = ""
        self._suffix = "csv"
        self._why_no_save = ""
        self._agreed: Callable[[], None] | None = None
        self._pair: tuple[int, int] | None = None

        # Widgets
        self._label = self.say(QLabel(), self.tr("LED &file"))
        self._path = self.say(
            PathField(),
            hint=self.tr("Table (CSV) or JSON file"),
            name=self.tr("LED file"),
        )
        self._open = self.make_button(self.tr("Open..."), self._on_open_clicked)
        self._path.add_button(self._open)
        self._save = self.make_button(self.tr("Save as..."), self._on_save_clicked)
        self._samples = self.make_button(
            self.tr("Use file of the simulated pen"), self.samples_requested
        )
        self._discover = self.make_button(
            self.tr("I have no such file..."),
            self.discovery_requested,
            tip=self.tr("Find pen, camera and tip by one swing and one length."),
        )
        if not can_discover:
            self._discover.hide()
        self._label.setBuddy(self._path.edit)
        self._units = _UnitsRow()
        self._problem = SignLabel()
        self._exchange = PushButton()
        self._exchange.hide()
        self._question = QuestionBar()

        # Layout
        layout = vertical_layout(self)
        self._row = horizontal_layout(layout)
        horizontal_layout(self._row, self._label, (self._path, 1), stretch=1)
        horizontal_layout(self._row, self._save, self._samples, self._discover)
        layout.addWidget(self._units)
        horizontal_layout(
            layout,
            (self._problem, 1),
            (self._exchange, 0, Qt.AlignmentFlag.AlignTop),
            spacing=2 * GRID,
        )
        layout.addWidget(self._question)

        # Connections
        self._path.path_chosen.connect(self.path_chosen)
        FileDrops(self).dropped.connect(self._path.take)
        self._exchange.clicked.connect(self._on_exchange_clicked)
        self._units.value_changed.connect(self._on_units_chosen)
        self._question.agreed.connect(self._on_agreed)
        self._question.declined.connect(self._on_declined)

        self._retranslate()

    def set_narrow(self, narrow: bool) -> None:
        """Place the buttons below the path, or beside it."""
        set_stacked(self._row, narrow)

    def value(self) -> str:
        """Return the path of the open file, not that being typed."""
        return self._value

    def set_value(self, path: str) -> None:
        """Show the path of another file."""
        self._value = path
        self._path.set_value(path)

    def problem(self) -> str:
        """Return the message on the file."""
        return self._problem.value().text

    def set_problem(self, sentence: str) -> None:
        """Set or clear the message."""
        self._path.set_faulty(bool(sentence))
        self._problem.set_value(StatusMessage.fault(sentence))

    def set_exchange(self, pair: tuple[int, int] | None) -> None:
        """Offer to swap two LEDs, by number; None hides the offer."""
        self._pair = pair
        self._exchange.setVisible(pair is not None)
        if pair is not None:
            self._exchange.setText(self.tr("Swap {0} and {1}").format(*pair))

    def ask_units(self, name: str) -> None:
        """Ask for missing units; an empty text ends the question."""
        self._units.ask(name)

    def ask(
        self, words: Callable[[], tuple[str, str]], agreed: Callable[[], None]
    ) -> None:
        """Ask before a loss; ``agreed`` is called on consent.

        ``words`` returns the question, and what agrees to it.
        """
        self._agreed = agreed
        self._question.set_words(lambda: Question(*words(), self.tr("Cancel")))
        self._question.ask()

    def withdraw(self) -> None:
        """Hide the question: the LEDs have changed."""
        if self._question.words():
            self._question.hide()
            self._on_declined()

    def refresh_question(self) -> None:
        """Word the question again; it ends where its words are empty by now."""
        self._question.refresh()

    def question(self) -> str:
        """Return the present question, or an empty text."""
        return self._question.words()

    def set_savable(self, why_not: str, suffix: str) -> None:
        """Set whether there is something to save, and the suggested name."""
        self._suffix = suffix
        self._why_no_save = why_not
        self._refresh_save_words()

    def set_has_samples(self, has_samples: bool) -> None:
        """Offer the file of the simulated pen, or not."""
        self._samples.setVisible(has_samples)

    def _on_open_clicked(self) -> None:
        self._path.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("LEDs of the pen"),
            self.tr("LEDs of a pen ({0})").format("*.csv *.txt *.json *.xlsx *.yaml"),
        )

    def _on_exchange_clicked(self) -> None:
        self.exchange_requested.emit(self._pair)

    def _on_units_chosen(self, units: str) -> None:
        self.units_chosen.emit(self._path.value(), units)

    def _on_save_clicked(self) -> None:
        dialog = QFileDialog(self, self.tr("Save LEDs"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
        filters = {
            "csv": self.tr("Tables ({0})").format("*.csv"),
            "json": self.tr("With name and nominal tip ({0})").format("*.json"),
        }
        dialog.setNameFilters(list(filters.values()))
        dialog.selectNameFilter(filters[self._suffix])
        dialog.setDefaultSuffix(self._suffix)
        folder = Path(self._path.value()).parent
        if folder.is_dir():
            dialog.setDirectory(str(folder))
        dialog.fileSelected.connect(self._on_save_path_picked)
        dialog.open()

    def _on_save_path_picked(self, text: str) -> None:
        path = Path(text)
        job = Job(lambda _: path.exists(), self)
        job.start(partial(self._on_save_path_seen, path))

    def _on_save_path_seen(self, path: Path, exists: bool) -> None:
        if not exists:
            self.save_chosen.emit(path)
            return
        self.ask(
            partial(self._replacing, path.name), lambda: self.save_chosen.emit(path)
        )

    def _replacing(self, name: str) -> tuple[str, str]:
        text = self.tr("{0} already exists. Replace it with these LEDs?")
        return text.format(name), self.tr("Replace")

    def _on_agreed(self) -> None:
        agreed, self._agreed = self._agreed, None
        if agreed is not None:
            agreed()

    def _on_declined(self) -> None:
        self._agreed = None
        self.ask_units("")
        self._path.set_value(self._value)

    def _retranslate(self) -> None:
        self.set_exchange(self._pair)
        self._refresh_save_words()

    def _refresh_save_words(self) -> None:
        tooltip = self.tr("Save the LEDs and use the saved file")
        self._save.set_why_not(self._why_no_save, tooltip)


class _UnitsRow(Translated, QWidget):
    """Asks for missing units of a file; hidden otherwise."""

    value_changed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._file_name = ""

        # Widgets
        self._words = SignLabel(wraps=False)
        self._choice = self.say(ChoiceField(), self.tr("Unit of the file"))
        self._choice.addItems(["", *UNITS])

        # Layout
        horizontal_layout(self, self._words, self._choice, 1, spacing=2 * GRID)

        # Connections
        self._choice.textActivated.connect(self._on_activated)

        self._retranslate()
        self.hide()

    def ask(self, file_name: str) -> None:
        self._file_name = file_name
        self._choice.setCurrentIndex(0)
        self._retranslate()
        self.setVisible(bool(file_name))
        if file_name:
            give_focus(self._choice)

    def _on_activated(self, units: str) -> None:
        if units:
            self.value_changed.emit(units)

    def _retranslate(self) -> None:
        words = self.tr("{0} does not state the unit of its coordinates. Choose it:")
        self._words.set_value(StatusMessage.warning(words.format(self._file_name)))


T = TypeVar("T")


class LedFileControl(QObject):
    """Carries out requests of the file panel; asks before edits are lost."""

    status_changed = Signal(str)  # text of the status line

    def __init__(
        self,
        leds: LedDraft,
        chosen_files: ChosenFiles,
        pens: PenFiles,
        panel: LedFilePanel,
    ) -> None:
        super().__init__(panel)
        self._leds, self._chosen_files, self._panel = leds, chosen_files, panel
        self._pens = pens
        self._shown = LedState()
        self._problem: Callable[[], str] = self._frame_error
        self._job = LatestJob(self)

        # Connections
        panel.path_chosen.connect(self._on_path_chosen)
        panel.units_chosen.connect(self._on_units_chosen)
        panel.save_chosen.connect(self._on_save_chosen)
        panel.samples_requested.connect(self._on_samples_requested)
        leds.changed.connect(self._on_draft_changed)

    def retranslate(self) -> None:
        """Update the messages on the file."""
        self._panel.set_problem(self._problem())
        draft = self._leds.state.draft
        with_more = bool(draft.name or any(draft.tip))
        why_not = why_not_savable(self._leds.state)
        self._panel.set_savable(why_not, "json" if with_more else "csv")

    def discard(self) -> None:
        """Discard the changes of the table, or a file that cannot be used."""
        self._unless_lost(self._discard)

    def drop_job(self) -> None:
        """Ignore the outcome of a file being read or written."""
        self._job.cancel()

    def _on_draft_changed(self) -> None:
        before, self._shown = self._shown, self._leds.state
        now = self._shown
        if now.draft != before.draft:
            self._panel.withdraw()
        if now.opened is not before.opened or now.path != before.path:
            self._panel.ask_units("")
            self._panel.set_value(now.path)
        self._panel.set_exchange(leds_to_exchange(now.check.frame))
        self._set_problem(self._frame_error)

    def _set_problem(self, problem: Callable[[], str]) -> None:
        """Show a message on the file in the selected language."""
        self._problem = problem
        self.retranslate()

    def _frame_error(self) -> str:
        frame = self._leds.state.check.frame
        return "" if frame is None else worded(frame.error)

    def _on_path_chosen(self, path: str) -> None:
        self._unless_lost(partial(self._open, Path(path)))

    def _on_units_chosen(self, path: str, units: str) -> None:
        self._unless_lost(partial(self._open, Path(path), units))

    def _on_samples_requested(self) -> None:
        self._unless_lost(self._use_samples)

    def _discard(self) -> None:
        """Return to the opened file, or to the file in use if that is invalid."""
        if self._leds.state.is_edited:
            self._leds.edit(self._leds.state.opened)
        else:
            self._leds.open_in_use()

    def _unless_lost(self, act: Callable[[], None]) -> None:
        """Run a function that discards the changes of the table, once confirmed."""
        if self._leds.state.is_edited:
            self._panel.ask(self._discarding, act)
        else:
            act()

    def _discarding(self) -> tuple[str, str]:
        return unsaved_leds_text(self._leds.state), self.tr("Discard changes")

    def _open(self, path: Path, units: str | None = None) -> None:
        self.status_changed.emit("")
        self._panel.ask_units("")
        before = self._leds.state.draft

        def take(opened: OpenedPen) -> None:
            """Show the file; ask first if the table has unsaved changes."""
            act = partial(self._on_opened, opened)
            if self._leds.state.draft == before:
                act()
            else:
                self._unless_lost(act)

        self._start(lambda _: open_pen(path, units), take)

    def _on_opened(self, opened: OpenedPen) -> None:
        if opened.file is not None and self._pens.doubt_about(opened.file):
            use = partial(self._use, opened.file)
            self._panel.ask(partial(self._doubt_question, opened.file), use)
        elif opened.file is not None:
            self._use(opened.file)
        elif opened.draft is not None:  # those in use stay in use
            self._leds.open(opened.draft, opened.path)
            self._set_problem(partial(worded, opened.problem))
        elif opened.needs_units:
            self._set_problem(str)
            self._panel.ask_units(opened.path.name)
        else:
            self._set_problem(
                partial(self._refusal, opened.problem, self._panel.value())
            )

    def _use(self, file: PenFile) -> None:
        self._leds.use(file)
        self._pens.keep(file)
        self._set_problem(str)

    def _doubt_question(self, file: PenFile) -> tuple[str, str]:
        words = self.tr("{0} Use it for this pen from now on?")
        text = words.format(self._pens.doubt_about(file))
        return text, self.tr("Use this file")

    def _refusal(self, why: Message | None, still_open: str) -> str:
        """Return why a file cannot be opened, and which one is open."""
        if not still_open:
            return worded(why)
        kept = self.tr("{0} remains open.").format(Path(still_open).name)
        return f"{worded(why)} {kept}"

    def _use_samples(self) -> None:
        if self._leds.state.is_edited:
            self._leds.show(self._leds.state.opened)
        self._chosen_files.use_samples()

    def _on_save_chosen(self, path: Path) -> None:
        state = self._leds.state
        pen = state.check.usable
        if pen is not None:
            on_saved = partial(self._on_saved, state.draft)
            self._start(lambda _: save_pen(pen, path), on_saved)

    def _on_saved(self, saved: PenDraft, file: PenFile) -> None:
        is_same = self._leds.state.draft == saved
        self._leds.use(file, keeps_changes=not is_same)
        self._pens.keep(file)
        if is_same:
            self._set_problem(str)
        words = self.tr("LEDs saved as {0} and in use.")
        self.status_changed.emit(words.format(file.path.name))

    def _start(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], None]
    ) -> None:
        """Read or write a file, and ignore the outcome of an earlier one."""
        self._job.start(
            function, on_succeeded, lambda sentence: self._set_problem(lambda: sentence)
        )
