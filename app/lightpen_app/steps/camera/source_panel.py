"""Where the images come from."""

from dataclasses import dataclass

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QGroupBox,
    QHBoxLayout,
    QMenu,
    QVBoxLayout,
    QWidget,
)

from lightpen.formats.images import SUFFIXES, VIDEO_SUFFIXES
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.phrases import QT_TRANSLATE_NOOP
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.path_field import PathField
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


@dataclass(frozen=True)
class SourceEntry:
    """A kind of source in the list.

    Attributes
    ----------
    has_place : bool
        Whether the user says where its images are.
    """

    kind: SourceKind
    name: str
    has_place: bool = False


SOURCES = (
    SourceEntry(
        SourceKind.SIMULATED, QT_TRANSLATE_NOOP("SourcePanel", "Simulated pen")
    ),
    SourceEntry(
        SourceKind.RECORDED,
        QT_TRANSLATE_NOOP("SourcePanel", "Recorded images"),
        has_place=True,
    ),
)


class SourcePanel(Translated, QGroupBox):
    """The choice of a source.

    Signals
    -------
    value_changed(SourceChoice)
    samples_requested()
        The files of the simulated pen are to be used.
    retry_requested()
        Open the same source once more.
    """

    value_changed = Signal(object)
    samples_requested = Signal()
    retry_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = SourceChoice()

        # Widgets
        self._kind = QComboBox()
        for _ in SOURCES:
            self._kind.addItem("")
        self._place = PathField()
        self._pick = PushButton()
        self._pick.setProperty("menu", True)
        self._place.add_button(self._pick)
        menu = QMenu(self._pick)
        self._folder = menu.addAction("")
        self._file = menu.addAction("")
        self._pick.setMenu(menu)
        self._samples = PushButton()
        self._retry = PushButton()

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        first = QHBoxLayout()
        first.setSpacing(GRID)
        first.addWidget(self._kind, 1)
        first.addWidget(self._samples)
        layout.addLayout(first)
        layout.addWidget(self._place)
        layout.addWidget(self._retry)

        # Connections
        self._kind.activated.connect(self._on_kind_chosen)
        self._place.value_changed.connect(self._on_place_changed)
        self._folder.triggered.connect(self._on_folder_triggered)
        self._file.triggered.connect(self._on_file_triggered)
        self._samples.clicked.connect(self.samples_requested)
        self._retry.clicked.connect(self.retry_requested)

        self._retranslate()
        self.set_faulty(False)
        self._refresh()

    def value(self) -> SourceChoice:
        """Return the source."""
        return self._value

    def set_value(self, value: SourceChoice) -> None:
        """Show another source."""
        if value == self._value:
            return
        self._value = value
        if self._entry.has_place:
            self._place.set_value(value.place)
        self._refresh()

    def set_faulty(self, faulty: bool) -> None:
        """Mark the source as one that could not be opened, and offer to try again."""
        self._place.set_faulty(faulty)
        self._retry.setVisible(faulty)

    @property
    def _entry(self) -> SourceEntry:
        return next(entry for entry in SOURCES if entry.kind is self._value.kind)

    def _on_kind_chosen(self, index: int) -> None:
        entry = SOURCES[index]
        place = self._place.value() if entry.has_place else ""
        self._choose(SourceChoice(entry.kind, place))
        if entry.has_place and not place:
            self._place.setFocus()

    def _on_place_changed(self, place: str) -> None:
        chosen = SourceChoice(self._value.kind, place)
        if chosen == self._value:
            self.retry_requested.emit()
        else:
            self._choose(chosen)

    def _on_folder_triggered(self) -> None:
        self._place.pick(
            QFileDialog.FileMode.Directory, self.tr("Folder of the recorded images")
        )

    def _on_file_triggered(self) -> None:
        patterns = " ".join(f"*{suffix}" for suffix in (*VIDEO_SUFFIXES, *SUFFIXES))
        self._place.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("Video of the pen"),
            self.tr("Videos and images ({0})").format(patterns),
        )

    def _choose(self, value: SourceChoice) -> None:
        if value != self._value:
            self.set_value(value)
            self.value_changed.emit(value)

    def _refresh(self) -> None:
        self._kind.setCurrentIndex(SOURCES.index(self._entry))
        self._place.setVisible(self._entry.has_place)
        self._samples.setVisible(self._value.kind is SourceKind.SIMULATED)

    def _retranslate(self) -> None:
        self.setTitle(self.tr("Source of the images"))
        for index, entry in enumerate(SOURCES):
            self._kind.setItemText(index, self.tr(entry.name))
        name = self.tr("Source of the images")
        self._kind.setAccessibleName(name)
        # On Linux the name of a list that drops down is what is chosen in it.
        self._kind.setAccessibleDescription(name)
        edit = self._place.edit()
        edit.setAccessibleName(self.tr("Folder, record or video"))
        edit.setPlaceholderText(self.tr("Folder, record or video"))
        self._pick.setText(self.tr("Open..."))
        self._folder.setText(self.tr("Folder or record..."))
        self._file.setText(self.tr("Video..."))
        self._samples.setText(self.tr("Use its files"))
        self._samples.setToolTip(
            self.tr("Use the intrinsics and the LED file of the simulated pen.")
        )
        self._retry.setText(self.tr("Try again"))
