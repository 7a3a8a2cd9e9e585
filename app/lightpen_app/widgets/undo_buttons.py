"""Undo and redo: two buttons, and the keys that the desktop has for them."""

from collections.abc import Callable

from PySide6.QtGui import QKeySequence, QShortcut, QUndoCommand, QUndoStack
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.widgets.translated import Translated


class UndoableStep(QUndoCommand):
    """An undoable step."""

    def __init__(self, do: Callable[[], object], undo: Callable[[], object]) -> None:
        super().__init__()
        self._do, self._undo = do, undo

    @override
    def redo(self) -> None:
        self._do()

    @override
    def undo(self) -> None:
        self._undo()


class UndoButtons(Translated, QWidget):
    """Undoes and redoes the last step of a stack.

    While ``scope`` is visible its keys do the same, wherever the focus is.
    """

    def __init__(self, stack: QUndoStack, scope: QWidget) -> None:
        super().__init__()
        self._can_undo, self._can_redo = stack.canUndo(), stack.canRedo()
        self._why_locked = ""

        # Widgets
        self._undo = self.make_button(self.tr("Undo"), least_width=0)
        self._redo = self.make_button(self.tr("Redo"), least_width=0)

        # Layout
        horizontal_layout(self, (self._undo, 1), (self._redo, 1))

        # Connections
        for button, standard, act in (
            (self._undo, QKeySequence.StandardKey.Undo, stack.undo),
            (self._redo, QKeySequence.StandardKey.Redo, stack.redo),
        ):
            button.clicked.connect(act)
            keys = QShortcut(scope)
            keys.setKeys(standard)
            keys.activated.connect(button.click)
        stack.canUndoChanged.connect(self._on_can_undo_changed)
        stack.canRedoChanged.connect(self._on_can_redo_changed)

        self._retranslate()

    def set_locked(self, why: str) -> None:
        """Disable undo and redo with a reason; enable them with an empty one."""
        self._why_locked = why
        self._refresh()

    # A stack that is being deleted still emits these: do not query it then.

    def _on_can_undo_changed(self, can_undo: bool) -> None:
        self._can_undo = can_undo  # a stack always shows the other next

    def _on_can_redo_changed(self, can_redo: bool) -> None:
        self._can_redo = can_redo
        self._refresh()

    def _refresh(self) -> None:
        no_undo = "" if self._can_undo else self.tr("Nothing to undo")
        no_redo = "" if self._can_redo else self.tr("Nothing to redo")
        shown = [
            (self._undo, no_undo, QKeySequence.StandardKey.Undo),
            (self._redo, no_redo, QKeySequence.StandardKey.Redo),
        ]
        shown.sort(key=lambda each: bool(each[1]))  # an enabled button takes the focus
        for button, nothing, keys in shown:
            if nothing and button.hasFocus() and shown[0][0].isEnabled():
                shown[0][0].setFocus()
            button.set_why_not(self._why_locked or nothing, _written(keys))

    @override
    def _retranslate(self) -> None:
        self._refresh()


def _written(keys: QKeySequence.StandardKey) -> str:
    return QKeySequence(keys).toString(QKeySequence.SequenceFormat.NativeText)
