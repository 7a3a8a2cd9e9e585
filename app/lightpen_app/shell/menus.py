"""Menus of the window: options, help for a step, and the About box."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath

from PySide6.QtCore import QCoreApplication, Qt, QUrl, Signal
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QTextBlockFormat,
    QTextCursor,
    QTextDocument,
    QTextTable,
)
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QMenu,
    QMessageBox,
    QTextBrowser,
    QWidget,
)

from lightpen_app.crash import versions
from lightpen_app.face import MenuEntry
from lightpen_app.look.languages import own_name
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID, Appearance, TextSize, Tone, text_label
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedWindow
from lightpen_app.widgets.operator_view import DISTANCES_M
from lightpen_app.work.settings import Preferences, data_folder
from lightpen_resources import RESOURCES, SOURCE_LANGUAGE, languages


class OptionsMenu(Translated, QMenu):
    """Shows and changes the preferences."""

    value_changed = Signal(object)  # Preferences: the user chose otherwise
    said = Signal(str)  # a sentence for the status line
    # A sentence: swings and results are kept elsewhere from the next start on.
    data_folder_chosen = Signal(str)
    log_requested = Signal()  # open the folder of the log

    def __init__(self, preferences: Preferences, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value = preferences
        self._choices: list[tuple[QAction, object]] = []
        self._entries: list[tuple[QAction, MenuEntry]] = []

        # Widgets
        self._languages = self.say(
            self._choice_menu("language", languages(), preferences.language),
            self.tr("Language"),
        )
        self._appearances = self.say(
            self._choice_menu("appearance", tuple(Appearance), preferences.appearance),
            self.tr("Appearance"),
        )
        self._distances = self.say(
            self._choice_menu(
                "distance_m", tuple(map(float, DISTANCES_M)), preferences.distance_m
            ),
            self.tr("Viewing distance"),
        )
        self.mute_action = self.say(QAction(self), self.tr("Mute sounds"))
        self.mute_action.setCheckable(True)
        self.mute_action.setChecked(preferences.muted)
        self.mute_action.setShortcut(Qt.Key.Key_B)
        self.addAction(self.mute_action)
        self.addSeparator()
        self._data_folder = self.say(self.addAction(""), self.tr("Data folder..."))
        self._about = self.say(self.addAction(""), self.tr("About Lightpen"))

        # Connections
        self.mute_action.toggled.connect(self._on_mute_toggled)
        self._data_folder.triggered.connect(self.ask_data_folder)
        self._about.triggered.connect(self._show_about)

        self._refresh()

    def value(self) -> Preferences:
        """Return the preferences in use."""
        return self._value

    def ask_data_folder(self) -> None:
        """Ask where swings and results are kept from the next start on."""
        dialog = QFileDialog(self.parentWidget(), self.tr("Data folder"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setDirectory(str(data_folder(self._value)))
        dialog.fileSelected.connect(self._on_data_folder_chosen)
        dialog.open()

    def add_entry(self, entry: MenuEntry, window: QWidget) -> None:
        """Add the entry of an extension."""
        action = QAction(self)
        action.triggered.connect(lambda: entry.choose(window))
        self.insertAction(self._about, action)
        self._entries.append((action, entry))
        self._refresh()

    def _on_data_folder_chosen(self, folder: str) -> None:
        self._choose(data_folder=folder)
        words = self.tr(
            "From the next start, swings and results are saved in {0}. Existing "
            "ones remain in place."
        )
        self.data_folder_chosen.emit(words.format(folder))

    def _on_mute_toggled(self, muted: bool) -> None:
        self._choose(muted=muted)
        self.said.emit(
            self.tr("Sounds are off.") if muted else self.tr("Sounds are on.")
        )

    def _show_about(self) -> None:
        about = About(versions(), self.parentWidget())
        about.log_requested.connect(self.log_requested)
        about.exec()

    def _choice_menu(
        self, preference: str, choices: Sequence[object], chosen: object
    ) -> QMenu:
        """Add a menu of the values that a preference may have."""
        menu = self.addMenu("")
        group = QActionGroup(menu)
        for value in choices:
            action = group.addAction("")
            action.setCheckable(True)
            action.setChecked(value == chosen)
            action.triggered.connect(
                lambda _=False, value=value: self._choose(**{preference: value})
            )
            self._choices.append((action, value))
        menu.addActions(group.actions())
        return menu

    def _choose(self, **changes: object) -> None:
        # Menus name the field that they change; mypy cannot know its type.
        self._value = replace(self._value, **changes)  # type: ignore[arg-type]
        self.value_changed.emit(self._value)

    def _choice_name(self, value: object) -> str:
        match value:
            case Appearance.SYSTEM:
                return self.tr("System default")
            case Appearance.LIGHT:
                return self.tr("Light")
            case Appearance.DARK:
                return self.tr("Dark")
            case str():
                return own_name(value)
        return self.tr("{0} m").format(f"{value:g}")

    def _refresh(self) -> None:
        for action, entry in self._entries:
            action.setText(entry.text())
        for action, value in self._choices:
            action.setText(self._choice_name(value))


def is_agreed_to_close(window: QWidget, question: str) -> bool:
    """Ask whether to close a window although something is not saved."""
    translate = QCoreApplication.translate
    box = QMessageBox(window)
    box.setIcon(QMessageBox.Icon.Question)
    box.setTextFormat(Qt.TextFormat.PlainText)
    box.setText(question)
    roles = QMessageBox.ButtonRole
    stay = box.addButton(translate("OptionsMenu", "Keep open"), roles.RejectRole)
    box.addButton(translate("OptionsMenu", "Close anyway"), roles.AcceptRole)
    box.setDefaultButton(stay)
    box.setEscapeButton(stay)
    box.exec()
    return box.clickedButton() is not stay


HELP = RESOURCES / "help"
_PROPORTIONAL = QTextBlockFormat.LineHeightTypes.ProportionalHeight.value


def help_text(key: str, language: str) -> str:
    """Return the help about a step or a method, as Markdown; in English if need be."""
    for folder in (language, SOURCE_LANGUAGE):
        path = HELP / folder / f"{key}.md"
        if path.is_file():
            return path.read_text("utf-8")
    raise ValueError(f"There is no help about {key!r}.")


class HelpWindow(FittedWindow, Translated, QWidget):
    """Shows one help text; Escape or F1 closes it."""

    CLOSING_KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_F1)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.say(self, self.tr("Help"))
        self.setObjectName("help")
        self._key = ""
        self._language = SOURCE_LANGUAGE
        self.resize(80 * GRID, 90 * GRID)

        # Widgets
        self._browser = self.say(QTextBrowser(), self.tr("Help"))
        self._browser.setOpenLinks(False)
        self._browser.anchorClicked.connect(self._on_anchor_clicked)

        # Layout
        vertical_layout(self, self._browser, margins=2 * GRID)

    def text(self) -> str:
        """Return the words shown."""
        return self._browser.toPlainText()

    def set_topic(self, key: str, language: str) -> None:
        """Show the help about a step or a method."""
        self._key, self._language = key, language
        self._browser.setSearchPaths([str(HELP / SOURCE_LANGUAGE)])  # of figures
        self._browser.setMarkdown(help_text(key, language))
        _space_out(self._browser.document())

    def set_language(self, language: str) -> None:
        """Show the same help in another language."""
        if self._key:
            self.set_topic(self._key, language)

    def _on_anchor_clicked(self, link: QUrl) -> None:
        self.set_topic(PurePosixPath(link.path()).stem, self._language)


def _space_out(document: QTextDocument) -> None:
    """Put the paragraphs on the grid; Markdown comes without any space."""
    document.setIndentWidth(3 * GRID)
    document.setDocumentMargin(2 * GRID)
    block = document.begin()
    while block.isValid():
        layout = block.blockFormat()
        in_table = QTextCursor(block).currentTable() is not None
        layout.setTopMargin(2 * GRID if layout.headingLevel() > 1 else 0)
        layout.setBottomMargin(0 if in_table else GRID)
        layout.setLineHeight(120, _PROPORTIONAL)
        QTextCursor(block).setBlockFormat(layout)
        block = block.next()
    for frame in document.rootFrame().childFrames():
        if isinstance(frame, QTextTable):
            table = frame.format().toTableFormat()
            table.setCellPadding(GRID // 2)
            table.setBorder(0)
            frame.setFormat(table)


class About(FittedWindow, QDialog):
    """Names, versions and licences; the text can be copied into a report."""

    log_requested = Signal()  # open the folder of the log

    def __init__(
        self, versions: Mapping[str, str], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(self.tr("About Lightpen"))
        self.setMinimumWidth(60 * GRID)

        # Widgets
        heading = text_label(TextSize.TITLE)
        heading.setText("Lightpen")
        purpose = text_label(TextSize.BODY)
        purpose.setText(self.tr("Calibration of the probe tip of a light pen"))
        self._versions = text_label(TextSize.BODY)
        self._versions.setText(
            "\n".join(f"{name} {number}" for name, number in versions.items())
        )
        licences = text_label(TextSize.SMALL, Tone.QUIET)
        licences.setText(
            self.tr(
                "Lightpen: MIT licence. Qt, PySide6 and psycopg: LGPL 3. FFmpeg, "
                "which some installations of OpenCV contain: LGPL 2.1. Fonts: cut from "
                "Noto Sans and Noto Sans CJK, SIL Open Font License 1.1."
            )
        )
        for label in (self._versions, licences):
            label.setTextInteractionFlags(
                Qt.TextInteractionFlag.TextSelectableByMouse
                | Qt.TextInteractionFlag.TextSelectableByKeyboard
            )
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        role = QDialogButtonBox.ButtonRole.ActionRole
        log = buttons.addButton(self.tr("Open the log"), role)

        # Layout
        parts = (heading, purpose, self._versions, licences, buttons)
        vertical_layout(self, *parts, spacing=2 * GRID, margins=3 * GRID)

        # Connections
        buttons.rejected.connect(self.reject)
        log.clicked.connect(self.log_requested)
