"""Panel of the LED file: open, save as, and the reason for failures."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFileDialog, QLabel, QWidget

from lightpen.formats.pen_content import UNITS
from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.choice_field import ChoiceField
from lightpen_app.widgets.file_drops import FileDrops
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.path_field import PathField
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.question_bar import Question, QuestionBar
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.job import Job


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
        self._path = PathField()
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
        self._path.edit.setAccessibleName(self.tr("LED file"))
        self._path.edit.setPlaceholderText(self.tr("Table (CSV) or JSON file"))
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
