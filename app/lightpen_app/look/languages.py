"""The languages of the program, changed while it runs."""

from enum import StrEnum

from PySide6.QtCore import QLibraryInfo, QLocale, QObject, QTranslator
from PySide6.QtWidgets import QApplication

from lightpen_app.look.theme import RESOURCES

TRANSLATIONS = RESOURCES / "translations"


class Language(StrEnum):
    """Each is named in itself, so that whoever cannot read the others finds it."""

    ENGLISH = "en"
    CHINESE = "zh_CN"

    @property
    def own_name(self) -> str:
        """Return how speakers call it."""
        return {Language.ENGLISH: "English", Language.CHINESE: "简体中文"}[self]


class LanguageSwitch(QObject):
    """Installs the translations of a language in the application.

    Every widget then gets a LanguageChange event and sets its texts anew.
    """

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._application = application
        self._language = Language.ENGLISH
        self._translators: list[QTranslator] = []

    def language(self) -> Language:
        """Return the language in use."""
        return self._language

    def set_language(self, language: Language) -> None:
        """Use another language, of numbers and of Qt's own texts too."""
        self.remove()
        self._language = language
        QLocale.setDefault(QLocale(language.value))
        qt_folder = QLibraryInfo.path(QLibraryInfo.LibraryPath.TranslationsPath)
        self._install(f"qtbase_{language}", qt_folder)
        self._install(f"lightpen_{language}", str(TRANSLATIONS))

    def remove(self) -> None:
        """Take the translations out; the texts in the program itself are left."""
        for translator in self._translators:
            self._application.removeTranslator(translator)
            translator.deleteLater()
        self._translators.clear()

    def _install(self, name: str, folder: str) -> None:
        translator = QTranslator(self)
        if translator.load(name, folder):
            self._application.installTranslator(translator)
        self._translators.append(translator)
