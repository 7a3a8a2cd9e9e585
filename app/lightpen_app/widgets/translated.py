"""Widgets with texts in the selected language, each declared once."""

from collections.abc import Callable, Iterable
from typing import TypeVar

from PySide6.QtCore import QCoreApplication, QEvent, Qt, SignalInstance
from PySide6.QtGui import QAction, QStandardItemModel
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QDialog,
    QGroupBox,
    QLabel,
    QLineEdit,
    QMenu,
    QTabBar,
    QTabWidget,
    QWidget,
)
from typing_extensions import override

from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import Message
from lightpen_app.look.layouts import GridPlace, Place
from lightpen_app.look.sentences import worded
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.keys import WidgetMixin
from lightpen_app.widgets.labelled import add_labelled, field_label
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.path_field import PathField
from lightpen_app.widgets.push_button import LEAST_WIDTH, PushButton

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
    on more is set by `_retranslate`.
    """

    _words_said: dict[tuple[Named | None, str | int], Text]

    def _retranslate(self) -> None:
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
        least_width: int = LEAST_WIDTH,
        checkable: bool = False,
    ) -> PushButton:
        """Return a button with its text, tool tip, and what a click does."""
        button = self.say(PushButton(least_width, checkable=checkable), text, tip=tip)
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
            self._retranslate()


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
