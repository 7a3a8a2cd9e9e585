"""The languages of the program, changeable at run time."""

from collections.abc import Iterable

from PySide6.QtCore import (
    QT_TRANSLATE_NOOP,
    QCoreApplication,
    QLibraryInfo,
    QLocale,
    QObject,
    QTranslator,
)
from PySide6.QtWidgets import QApplication

from lightpen.formats.own_json import StoredMessage
from lightpen.messages import COMMA, Message
from lightpen_resources import SOURCE_LANGUAGE, TRANSLATIONS, languages

# Each language is named in itself, for users who cannot read the others.
OWN_NAME = str(QT_TRANSLATE_NOOP("language", "English"))
# Of Qt's file dialog, which its own Chinese translation lacks.
_OF_QT = (
    QT_TRANSLATE_NOOP("QFileDialog", "&Look in:"),
    QT_TRANSLATE_NOOP("QFileDialog", "Files of &type:"),
)


def own_name(language: str) -> str:
    """Return the name of a language in itself, from its translation."""
    translator = QTranslator()
    translator.load(f"lightpen_{language}", str(TRANSLATIONS))
    return translator.translate("language", OWN_NAME) or OWN_NAME


def system_language() -> str:
    """Return the language of the system if available, else English."""
    system = QLocale.system()
    for language in languages():
        if QLocale(language).language() == system.language():
            return language
    return SOURCE_LANGUAGE


class LanguageSwitch(QObject):
    """Installs the translations of a language in the application.

    Every widget then gets a LanguageChange event and sets its texts again.
    """

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._application = application
        self._translators: list[QTranslator] = []

    def set_language(self, language: str) -> None:
        """Switch the language, also of numbers and of Qt's own texts."""
        self.remove()
        QLocale.setDefault(QLocale(language))
        qt_folder = QLibraryInfo.path(QLibraryInfo.LibraryPath.TranslationsPath)
        self._install(f"qtbase_{language}", qt_folder)
        self._install(f"lightpen_{language}", str(TRANSLATIONS))

    def remove(self) -> None:
        """Remove the translations; the program's own texts remain."""
        for translator in self._translators:
            self._application.removeTranslator(translator)
            translator.deleteLater()
        self._translators.clear()

    def _install(self, name: str, folder: str) -> None:
        translator = QTranslator(self)
        if translator.load(name, folder):
            self._application.installTranslator(translator)
        self._translators.append(translator)


CONTEXT = "core"


def worded(message: Message | StoredMessage | str | None) -> str:
    """Return the words of a message of the core, or a name; empty if there is none."""
    if isinstance(message, str):
        return message
    if isinstance(message, StoredMessage):
        return message.worded(translated)
    return "" if message is None else message.text(translated)


def listed(words: Iterable[str]) -> str:
    """Return words with the comma of the language between them."""
    return worded(COMMA).join(words)


def translated(template: str) -> str:
    """Return a template of the core in the language that is chosen."""
    return QCoreApplication.translate(CONTEXT, template)
