"""Help for one step, in its own window, with linked pages."""

from pathlib import PurePosixPath

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QTextBlockFormat, QTextCursor, QTextDocument, QTextTable
from PySide6.QtWidgets import QTextBrowser, QWidget

from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.fitted_window import FittedWindow
from lightpen_app.widgets.translated import Translated
from lightpen_resources import RESOURCES, SOURCE_LANGUAGE

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
