"""The application around the window: fonts, colours, language, sounds, crash hook."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QObject
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from lightpen.errors import LightpenError
from lightpen_app.crash import CrashHook
from lightpen_app.languages import LanguageSwitch
from lightpen_app.main_window import MainWindow
from lightpen_app.pages.page import Page
from lightpen_app.settings import Preferences, Settings, data_folder, settings_file
from lightpen_app.sounds import Mute, Sounds, find_sounds
from lightpen_app.theme import apply_theme, colors_for, load_fonts


@dataclass(frozen=True, eq=False)
class Services:
    """What a page may need from the application.

    Attributes
    ----------
    settings : Settings
    sounds : Sounds
    folder : Path
        Where records are kept unless the user says otherwise.
    """

    settings: Settings
    sounds: Sounds
    folder: Path


MakePages: TypeAlias = Callable[[Services], Sequence[Page]]


class Wizard(QObject):
    """The window and all that serves it.

    Parameters
    ----------
    application : QApplication
    make_pages : callable
        Returns the pages in the order of the steps.
    settings : Settings
    folder : Path
        For records, sounds and crash reports.
    """

    def __init__(
        self,
        application: QApplication,
        make_pages: MakePages,
        settings: Settings,
        folder: Path,
    ) -> None:
        super().__init__(application)
        self._application = application
        self._settings = settings
        self._preferences = settings.preferences()
        self._languages = LanguageSwitch(application)
        self._languages.set_language(self._preferences.language)
        load_fonts()
        self._apply_appearance()
        self._sounds = Mute(
            find_sounds(folder / "sounds"), muted=self._preferences.muted
        )
        services = Services(settings, self._sounds, folder)
        self.window = MainWindow(make_pages(services), settings, self._preferences)
        self.crash_hook = CrashHook(folder / "crashes", self)

        # Connections
        self.crash_hook.reported.connect(self.window.show_crash_report)
        self.window.preferences_changed.connect(self._on_preferences_changed)
        QGuiApplication.styleHints().colorSchemeChanged.connect(self._apply_appearance)

    def _on_preferences_changed(self, preferences: Preferences) -> None:
        before, self._preferences = self._preferences, preferences
        try:
            self._settings.set_preferences(preferences)
        except LightpenError as error:
            self.window.show_notice(str(error))
        self._sounds.muted = preferences.muted
        if preferences.language is not before.language:
            self._languages.set_language(preferences.language)
        if preferences.appearance is not before.appearance:
            self._apply_appearance()

    def _apply_appearance(self) -> None:
        scheme = QGuiApplication.styleHints().colorScheme()
        colors = colors_for(self._preferences.appearance, scheme)
        apply_theme(self._application, colors)


def make_application(arguments: Sequence[str]) -> QApplication:
    """Return the QApplication of the program."""
    QApplication.setStyle("Fusion")
    application = QApplication(list(arguments))
    application.setApplicationName("lightpen")
    application.setApplicationDisplayName("Lightpen")
    return application


def run(make_pages: MakePages, arguments: Sequence[str] = sys.argv) -> int:
    """Show the wizard until its window closes, and return the exit status."""
    application = make_application(arguments)
    wizard = Wizard(application, make_pages, Settings(settings_file()), data_folder())
    wizard.crash_hook.install()
    wizard.window.show()
    try:
        return application.exec()
    finally:
        wizard.crash_hook.remove()
