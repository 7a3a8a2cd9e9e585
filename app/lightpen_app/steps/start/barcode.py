"""Barcode scanner input, distinguished from typing by its speed."""

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QHideEvent, QKeyEvent, QShowEvent, QWindow
from typing_extensions import override

from lightpen_app.widgets.keys import ENTER_KEYS, WidgetMixin

PACE_MS = 50  # from one key of a scanner to the next at most; a hand takes longer
PATIENCE_MS = 60  # without a key that end a scan
SHORTEST = 3  # characters; a hand may hit two keys at once
MODIFIERS = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.KeypadModifier
SHIFTS = (Qt.Key.Key_Shift, Qt.Key.Key_CapsLock)


class BarcodeListener(QObject):
    """Intercepts a barcode and its Enter in a window, wherever the focus is.

    Keys are held back for an imperceptible moment and forwarded unless they are a
    barcode. The windowing system stamps their times, so keys that waited for a busy
    program are not mistaken for a scanner's.
    """

    scanned = Signal(str)  # the characters of a barcode

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._window: QWindow | None = None
        self._held: list[QKeyEvent] = []
        self._last_ms = 0
        self._hands_on = False
        self._patience = QTimer(self, singleShot=True, interval=PATIENCE_MS)

        # Connections
        self._patience.timeout.connect(self._release)

    def listen(self, window: QWindow | None) -> None:
        """Listen to the keys of another window, or of none."""
        if self._window is not None:
            self._release()
            self._window.removeEventFilter(self)
        self._window = window
        if window is not None:
            window.installEventFilter(self)

    def takes(self, event: QEvent) -> bool:
        """Accept a key of a barcode before it is taken for a shortcut."""
        if not (isinstance(event, QKeyEvent) and self.is_continuation(event)):
            return False
        event.accept()
        return True

    def is_continuation(self, event: QKeyEvent) -> bool:
        """Return whether a key continues the held-back ones."""
        pressed = event.timestamp()
        return bool(self._held) and pressed - self._last_ms <= PACE_MS

    @override
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if self._hands_on or not isinstance(event, QKeyEvent):
            return False
        if event.type() != QEvent.Type.KeyPress or event.key() in SHIFTS:
            return False
        if self._held and not self.is_continuation(event):
            self._release()
        if event.key() in ENTER_KEYS:
            return self._ends_with(event)
        if not _is_of_barcode(event) or (event.text() == " " and not self._held):
            self._release()
            return False
        self._held.append(event.clone())
        self._last_ms = event.timestamp()
        self._patience.start()
        return True

    def _ends_with(self, event: QKeyEvent) -> bool:
        """Report the barcode ended by Enter, or pass the keys on."""
        code = "".join(each.text() for each in self._held)
        if len(code) < SHORTEST:
            self._release()
            return False
        self._patience.stop()
        self._held.clear()
        self.scanned.emit(code.strip())
        return True

    def _release(self) -> None:
        """Pass the held-back keys on."""
        self._patience.stop()
        held, self._held = self._held, []
        self._hands_on = True
        for each in held:
            if self._window is not None:
                QCoreApplication.sendEvent(self._window, each)
        self._hands_on = False


class HearsBarcodes(WidgetMixin):
    """Mixin before the base of a widget: listens to barcodes while it is shown."""

    barcodes: BarcodeListener

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.barcodes.listen(self.window().windowHandle())

    @override
    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.barcodes.listen(None)

    @override
    def event(self, event: QEvent) -> bool:
        """Keep the keys of a barcode from triggering shortcuts."""
        if event.type() == QEvent.Type.ShortcutOverride:
            return self.barcodes.takes(event) or super().event(event)
        return super().event(event)


def _is_of_barcode(event: QKeyEvent) -> bool:
    text = event.text()
    return (
        len(text) == 1
        and text.isprintable()
        and not event.isAutoRepeat()
        and not event.modifiers() & ~MODIFIERS
    )
