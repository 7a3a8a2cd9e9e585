"""The archive as a whole: checked, saved for other programs, and taken up."""

from collections.abc import Sequence
from enum import Enum, auto

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QMenu, QProgressBar, QVBoxLayout, QWidget

from lightpen.archive.check import Checked
from lightpen.archive.logbook import Delivered
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated

MOST_TOLD = 100  # findings; the rest is counted


class Saving(Enum):
    """What is saved."""

    TABLE = auto()
    JSON = auto()
    WHOLE = auto()

    @property
    def suffix(self) -> str:
        """Of the file."""
        return {Saving.TABLE: ".csv", Saving.JSON: ".json", Saving.WHOLE: ".jsonl"}[
            self
        ]


class ArchivePanel(Translated, QWidget):
    """Three buttons, what the last check came to, and what the server has.

    Signals
    -------
    check_requested(), cancel_requested()
    import_requested()
    save_requested(Saving)
    """

    check_requested = Signal()
    cancel_requested = Signal()
    import_requested = Signal()
    save_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._checked: Checked | None = None
        self._delivery: Delivered | None = None

        # Widgets
        self._check = PushButton()
        self._import = PushButton()
        self._save = PushButton()
        self._save.setProperty("menu", True)
        menu = QMenu(self._save)
        self._savings: dict[Saving, QAction] = {
            saving: menu.addAction("") for saving in Saving
        }
        self._save.setMenu(menu)
        self._progress = QProgressBar()
        self._progress.setRange(0, 100)
        self._cancel = PushButton()
        self._working = QWidget()
        self._delivered = SignLabel()
        self._outcome = SignLabel()
        self._findings: list[SignLabel] = []

        # Layout
        buttons = QHBoxLayout()
        buttons.setSpacing(GRID)
        for button in (self._check, self._save, self._import):
            buttons.addWidget(button)
        buttons.addStretch(1)
        working = QHBoxLayout(self._working)
        working.setContentsMargins(0, 0, 0, 0)
        working.setSpacing(2 * GRID)
        working.addWidget(self._progress, 1)
        working.addWidget(self._cancel)
        self._layout = layout = QVBoxLayout(self)
        layout.setContentsMargins(0, GRID, 0, 0)
        layout.setSpacing(GRID)
        layout.addLayout(buttons)
        layout.addWidget(self._working)
        layout.addWidget(self._delivered)
        layout.addWidget(self._outcome)
        layout.addStretch(1)
        self._working.hide()

        # Connections
        self._check.clicked.connect(self.check_requested)
        self._import.clicked.connect(self.import_requested)
        self._cancel.clicked.connect(self.cancel_requested)
        for saving, action in self._savings.items():
            action.triggered.connect(
                lambda _=False, saving=saving: self.save_requested.emit(saving)
            )

        self._retranslate()

    def set_working(self, working: bool) -> None:
        """Show that something is under way, and let nothing else begin."""
        self._progress.setValue(0)
        self._working.setVisible(working)
        self._refresh_buttons()

    def set_progress(self, fraction: float) -> None:
        """Show how far it is, 0 to 1."""
        self._progress.setValue(round(100 * fraction))

    def set_checked(self, checked: Checked | None) -> None:
        """Show what a check came to; None as long as there was none."""
        self._checked = checked
        self._retranslate()

    def set_delivery(self, delivery: Delivered | None) -> None:
        """Show how far the server has what was entered; None without a server."""
        self._delivery = delivery
        self._show_delivery()

    def told(self) -> Sequence[Remark]:
        """Return what is said of the server and of the check."""
        labels = (self._delivered, self._outcome, *self._findings)
        return [label.value() for label in labels if label.value().text]

    def _retranslate(self) -> None:
        self._check.setText(self.tr("Check the archive"))
        self._import.setText(self.tr("Take up another station's..."))
        self._save.setText(self.tr("Save..."))
        self._cancel.setText(self.tr("Cancel"))
        for saving, text in (
            (Saving.TABLE, self.tr("Entries shown (CSV)...")),
            (Saving.JSON, self.tr("Entries shown (JSON)...")),
            (Saving.WHOLE, self.tr("All, for another station...")),
        ):
            self._savings[saving].setText(text)
        self._refresh_buttons()
        self._show_delivery()
        self._show_outcome()

    def _refresh_buttons(self) -> None:
        is_working = not self._working.isHidden()
        why_not = self.tr("Something else is under way.") if is_working else ""
        told = (
            self.tr("Read every entry, record, result and image, and compare"),
            self.tr("For other programs, or for another station"),
            self.tr("Copy the entries of a file that was saved at another station"),
        )
        buttons = (self._check, self._save, self._import)
        for button, words in zip(buttons, told, strict=True):
            button.set_why_not(why_not, words)

    def _show_delivery(self) -> None:
        delivery = self._delivery
        remark = Remark("") if delivery is None else self._remark_on(delivery)
        self._delivered.set_value(remark)

    def _remark_on(self, delivery: Delivered) -> Remark:
        n_waiting, trouble = delivery.n_waiting, delivery.trouble
        if trouble is not None:
            text = self.tr(
                "The server does not have all entries. They stay here, and are "
                "delivered when it answers. {0}"
            )
            return Remark(text.format(worded(trouble)), Sign.WARNING, Tone.WARN)
        if n_waiting == 0:
            return Remark(self.tr("The server has all entries."), Sign.CHECK, Tone.GOOD)
        return Remark(self.tr("Entries are being delivered to the server."))

    def _show_outcome(self) -> None:
        checked = self._checked
        findings = () if checked is None else checked.findings
        texts = list(map(worded, findings[:MOST_TOLD]))
        if len(findings) > MOST_TOLD:
            n_more = len(findings) - MOST_TOLD
            texts.append(self.tr("{0} more were found.").format(n_more))
        while len(self._findings) < len(texts):
            label = SignLabel()
            self._findings.append(label)
            self._layout.insertWidget(self._layout.count() - 1, label)
        for i, label in enumerate(self._findings):
            text = texts[i] if i < len(texts) else ""
            label.set_value(Remark(text, Sign.CROSS, Tone.BAD))
        self._outcome.set_value(self._outcome_of(checked))

    def _outcome_of(self, checked: Checked | None) -> Remark:
        if checked is None:
            return Remark(self.tr("Not checked since the program was started."))
        told = (checked.n_entries, checked.n_files)
        if checked.findings:
            text = self.tr(
                "Something was changed. {0} entries and {1} files were read."
            )
            return Remark(text.format(*told), Sign.WARNING, Tone.WARN)
        text = self.tr("No change was found in {0} entries and {1} files.")
        return Remark(text.format(*told), Sign.CHECK, Tone.GOOD)
