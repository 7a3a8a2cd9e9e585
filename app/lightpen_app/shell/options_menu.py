"""The options of the program: language, appearance, viewing distance, sounds."""

from collections.abc import Sequence
from dataclasses import replace

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from lightpen_app.face import MenuEntry
from lightpen_app.look.languages import own_name
from lightpen_app.look.theme import Appearance
from lightpen_app.widgets.operator_view import DISTANCES_M
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.settings import Preferences
from lightpen_resources import languages


class OptionsMenu(Translated, QMenu):
    """Shows and changes the preferences."""

    value_changed = Signal(object)  # Preferences: the user chose otherwise
    data_folder_chosen = Signal()  # the user wants to keep swings and results elsewhere
    about_chosen = Signal()  # show the description of the program

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
        self.mute_action.toggled.connect(lambda muted: self._choose(muted=muted))
        self._data_folder.triggered.connect(self.data_folder_chosen)
        self._about.triggered.connect(self.about_chosen)

        self._retranslate()

    def value(self) -> Preferences:
        """Return the preferences in use."""
        return self._value

    def set_data_folder(self, folder: str) -> None:
        """Keep swings and results elsewhere, from the next start on."""
        self._choose(data_folder=folder)

    def add_entry(self, entry: MenuEntry, window: QWidget) -> None:
        """Add the entry of an extension."""
        action = QAction(self)
        action.triggered.connect(lambda: entry.choose(window))
        self.insertAction(self._about, action)
        self._entries.append((action, entry))
        self._retranslate()

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

    def _retranslate(self) -> None:
        for action, entry in self._entries:
            action.setText(entry.text())
        for action, value in self._choices:
            action.setText(self._choice_name(value))
