"""Fields of forms, and their texts, which follow the language."""

from collections.abc import Callable, Iterable
from datetime import date
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QCoreApplication, QEvent, Qt, Signal, SignalInstance
from PySide6.QtGui import QAction, QKeyEvent, QStandardItemModel, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QDialog,
    QFileDialog,
    QGroupBox,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QSizePolicy,
    QTabBar,
    QTabWidget,
    QWidget,
)
from typing_extensions import override

from lightpen.formats.own_json import StoredMessage
from lightpen.messages import Message
from lightpen.record.library.supervision import Signature
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import (
    GridPlace,
    Place,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.controls import (
    ENTER_KEYS,
    LeavesPageKeys,
    PushButton,
    WidgetMixin,
    give_focus,
)
from lightpen_app.widgets.number_field import NumberField


class ChoiceField(LeavesPageKeys, QComboBox):
    """A choice that neither the wheel nor the keys of the steps change."""

    @override
    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()


def field_label(field: QWidget) -> QLabel:
    """Return a label for the name of a field."""
    label = text_label(TextSize.SMALL, Tone.QUIET)
    label.setWordWrap(False)
    label.setBuddy(field)
    return label


def add_labelled(
    place: Place,
    label: QLabel,
    field: QWidget,
    *,
    stretch: int = 0,
    at: GridPlace = (0, 0),
) -> None:
    """Add a label with its field below; for the place see `vertical_layout`."""
    vertical_layout(place, label, field, spacing=GRID // 2, stretch=stretch, at=at)


QUOTES = "\"'"


class EnterEdit(QLineEdit):
    """A line edit whose Enter key only ends editing.

    Where nothing was edited, Enter is left to the window.
    """

    entered = Signal()  # Enter was pressed after an edit

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        was_edited = self.isModified()
        super().keyPressEvent(event)
        if event.key() in ENTER_KEYS:
            event.setAccepted(was_edited)
            self.setModified(False)
            if was_edited:
                self.entered.emit()


class PathField(QWidget):
    """A path that is taken over when Enter is pressed or the field is left."""

    # Another path was given, or a faulty one again by Enter.
    value_changed = Signal(str)
    path_chosen = Signal(str)  # so it was, and it is not empty

    def __init__(self) -> None:
        super().__init__()
        self._value = self._last = ""
        self._is_faulty = False

        # Widgets
        self.edit = EnterEdit()
        self.edit.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFocusProxy(self.edit)

        # Layout
        self._layout = horizontal_layout(self, (self.edit, 1))

        # Connections
        self.edit.returnPressed.connect(self._on_return_pressed)
        self.edit.editingFinished.connect(self._on_editing_finished)

    def value(self) -> str:
        """Return the path that was given last."""
        return self._value

    def set_value(self, value: str) -> None:
        """Show another path."""
        self._value, self._last = value, value or self._last
        self.edit.setText(value)
        set_tooltip(self.edit, value)

    def set_faulty(self, faulty: bool) -> None:
        """Mark the path as not existing."""
        self._is_faulty = faulty
        set_tone(self.edit, Tone.BAD if faulty else Tone.PLAIN)

    def add_button(self, button: QPushButton) -> None:
        """Add a button beside the line."""
        self._layout.addWidget(button)

    def pick(
        self, mode: QFileDialog.FileMode, title: str, name_filter: str = ""
    ) -> None:
        """Let the user pick a file or a folder in a dialog, and take it over.

        The dialog opens where the last one was.
        """
        dialog = QFileDialog(self, title)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(mode)
        if mode is QFileDialog.FileMode.Directory:
            dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        elif name_filter:
            dialog.setNameFilter(name_filter)
        last = Path(self._last)
        if self._last and last.parent.is_dir():
            dialog.setDirectory(str(last if last.is_dir() else last.parent))
        dialog.fileSelected.connect(self.accept)
        dialog.open()

    def accept(self, path: str) -> None:
        """Take over a path as if it were typed."""
        self.set_value(path)
        self.value_changed.emit(path)
        if path:
            self.path_chosen.emit(path)

    def _typed(self) -> str:
        """Return the text without the quotes added by a desktop."""
        text = self.edit.text().strip()
        for quote in QUOTES:
            if len(text) > 1 and text.startswith(quote) and text.endswith(quote):
                text = text[1:-1]
        return str(Path(text).expanduser()) if text.startswith("~") else text

    def _on_return_pressed(self) -> None:
        """Accept the typed path; consume Enter, which the window uses otherwise."""
        if self.edit.isModified() or self._is_faulty:
            self.accept(self._typed())

    def _on_editing_finished(self) -> None:
        if self._typed() != self._value:
            self.accept(self._typed())


Named = QWidget | QAction | QStandardItemModel
N = TypeVar("N", bound=Named)
W = TypeVar("W", bound=QWidget)
V = TypeVar("V")


class Text(str):
    """A text in the selected language that can be worded again in another."""

    again: Callable[[], str]

    def __new__(cls, again: Callable[[], str]) -> "Text":
        """Word it in the present language."""
        text = super().__new__(cls, again())
        text.again = again
        return text

    @override
    def format(self, *values: object, **named: object) -> "Text":
        again = self.again
        return Text(lambda: again().format(*map(anew, values), **named))


def core_text(
    message: Message | StoredMessage, shaped: Callable[[str], str] = str
) -> str:
    """Return a message of the core that follows the language."""
    return Text(lambda: shaped(worded(message)))


class Translated(WidgetMixin):
    """Mixin before the base of a widget: its texts follow the language.

    `say`, `say_items`, `make_button` and `make_field` give a fixed text. What depends
    on more is set by `_refresh`.
    """

    _words_said: dict[tuple[Named | None, str | int], Text]

    def _refresh(self) -> None:
        """Set the texts that depend on what is shown."""

    @override
    def tr(self, source: str, *_: object) -> str:
        contexts = _contexts(type(self))
        return Text(lambda: _translated(contexts, source))

    def say(
        self, of: N, text: str = "", *, tip: str = "", hint: str = "", name: str = ""
    ) -> N:
        """Give a widget or an action its words, and return it.

        Parameters
        ----------
        of : QWidget, QAction or QStandardItemModel
            Also the widget that says it.
        text : str
            On a label, button or frame, in the title bar of a window, else the
            accessible name.
        tip : str
            Tool tip.
        hint : str
            Shown in a field while it is empty; by default also its accessible name.
        name : str
            Accessible name, if it is another one.
        """
        if hint and not (text or name):
            name = hint
        for part, words in (("tip", tip), ("hint", hint), ("name", name), ("", text)):
            if words:
                self._say_part(of, part, words)
        return of

    def say_items(self, of: N, texts: Iterable[str]) -> N:
        """Name the choices of a list, the tabs or the columns of a table, in order."""
        for number, words in enumerate(texts):
            if isinstance(of, QComboBox | QTabBar) and number >= of.count():
                of.addItem("") if isinstance(of, QComboBox) else of.addTab("")
            self._say_part(of, number, words)
        return of

    def make_button(
        self,
        text: str,
        clicked: Callable[..., object] | SignalInstance | None = None,
        *,
        tip: str = "",
        checkable: bool = False,
    ) -> PushButton:
        """Return a button with its text, tool tip, and what a click does."""
        button = self.say(PushButton(checkable=checkable), text, tip=tip)
        if clicked is not None:
            button.clicked.connect(clicked)
        return button

    def make_label(
        self, field: QWidget, text: str, *, tip: str = "", hint: str = ""
    ) -> QLabel:
        """Return a label for a field, and name the field by it."""
        self.say(field, name=text, tip=tip, hint=hint)
        return self.say(field_label(field), text)

    def make_field(
        self,
        place: Place,
        field: W,
        text: str,
        *,
        tip: str = "",
        hint: str = "",
        stretch: int = 0,
        at: GridPlace = (0, 0),
    ) -> W:
        """Add a field below its name, and return it; see `vertical_layout`."""
        label = self.make_label(field, text, tip=tip, hint=hint)
        add_labelled(place, label, field, stretch=stretch, at=at)
        return field

    def _say_part(self, of: Named, part: str | int, words: str) -> None:
        _set(of, part, words)
        said = self.__dict__.setdefault("_words_said", {})
        # Without a reference to itself, which only the collector of garbage would end.
        key = (None if of is self else of), part
        if isinstance(words, Text):
            said[key] = words
        else:
            said.pop(key, None)

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange:
            for (of, part), words in self.__dict__.get("_words_said", {}).items():
                _set(self if of is None else of, part, words.again())
            self._refresh()


def _set(of: Named, part: str | int, words: str) -> None:
    match part, of:
        case int(), QComboBox():
            of.setItemText(part, words)
        case int(), QTabBar() | QTabWidget():
            of.setTabText(part, words)
        case int(), QStandardItemModel():
            of.setHeaderData(part, Qt.Orientation.Horizontal, words)
        case _, PathField():
            _set(of.edit, part, words)
        case "tip", QWidget() | QAction():
            set_tooltip(of, words)
        case "hint", NumberField():
            of.set_empty_text(words)
        case "hint", QComboBox() | QLineEdit():
            of.setPlaceholderText(words)
        case "", QLabel() | QAbstractButton() | QAction():
            of.setText(words)
        case "", QGroupBox() | QMenu():
            of.setTitle(words)
        case "", QDialog():
            of.setWindowTitle(words)
        case "" | "name", QWidget():
            of.setAccessibleName(words)
        case _:
            raise ValueError(f"{of} has no {part}.")


def anew(value: V) -> V | str:
    """Return a text in the present language; any other value as it is."""
    return Text(value.again) if isinstance(value, Text) else value


def _contexts(kind: type) -> tuple[str, ...]:
    """Return the contexts of the texts of a class: itself, and what it derives from."""
    own = (each for each in kind.__mro__ if each.__module__.startswith("lightpen"))
    return tuple(each.__name__ for each in own)


def _translated(contexts: tuple[str, ...], source: str) -> str:
    """Return a text in the present language, from the first context that has it."""
    for context in contexts:
        text = QCoreApplication.translate(context, source)
        if text != source:
            return text
    return source


EXAMPLE = date(2025, 8, 14)  # of a day that is over


class DateField(Translated, EnterEdit):
    """A date such as 2026-08-14; an invalid one is marked and ignored.

    The example is shown while it is empty.
    """

    value_changed = Signal()

    def __init__(self, example: date = EXAMPLE) -> None:
        super().__init__()
        self._value: date | None = None
        self.setPlaceholderText(f"{example}")
        words = self.tr("Date, for example {0}; empty for any date")
        self.say(self, tip=words.format(example))

        # Connections
        self.textChanged.connect(self._on_text_changed)

    def value(self) -> date | None:
        """Return the day; None for any."""
        return self._value

    def set_value(self, day: date | None) -> None:
        """Show another day, or none."""
        self.setText("" if day is None else f"{day}")

    def _on_text_changed(self, text: str) -> None:
        before, typed = self._value, text.strip()
        try:
            self._value = date.fromisoformat(typed) if typed else None
        except ValueError:
            self._value = None
        is_wrong = bool(typed) and self._value is None
        set_tone(self, Tone.BAD if is_wrong else Tone.PLAIN)
        if self._value != before:
            self.value_changed.emit()


LONGEST = 100  # characters


class SupervisorFields(Translated, QWidget):
    """Name and password."""

    value_edited = Signal()  # something is being typed
    entered = Signal()  # the Enter key was pressed in the password

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._name = self.say(EnterEdit(), hint=self.tr("Supervisor"))
        password = self.tr("Supervisor password")
        self._password = self.say(EnterEdit(), hint=password)
        self._password.setEchoMode(QLineEdit.EchoMode.Password)

        # Layout
        horizontal_layout(self, (self._name, 1), (self._password, 1))

        # Connections
        for edit in (self._name, self._password):
            edit.setMaxLength(LONGEST)
            edit.textChanged.connect(self.value_edited)
        self._password.returnPressed.connect(self.entered)

    def value(self) -> Signature:
        """Return the signature."""
        return Signature(self._name.text().strip(), self._password.text())

    def is_filled(self) -> bool:
        """Return whether both are typed."""
        return bool(self.value().name and self.value().password)

    def clear(self) -> None:
        """Clear the fields."""
        self._name.clear()
        self._password.clear()

    def clear_password(self) -> None:
        """Have the password typed again."""
        self._password.clear()
        give_focus(self._password)
