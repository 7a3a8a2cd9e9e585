"""Asks why an acceptance is revoked, and a supervisor to sign."""

from PySide6.QtCore import QCoreApplication, QEvent
from typing_extensions import override

from lightpen_app.widgets.reason_bar import ReasonBar


class WithdrawalBar(ReasonBar):
    """A `ReasonBar` for revoking the acceptance of a tip."""

    def __init__(self) -> None:
        super().__init__()
        self._retranslate()

    @override
    def changeEvent(self, event: QEvent) -> None:
        """Follow the language."""
        if event.type() is QEvent.Type.LanguageChange:
            self._retranslate()
        super().changeEvent(event)

    def _retranslate(self) -> None:
        translate = QCoreApplication.translate
        self.set_words(
            translate(
                "WithdrawalBar",
                "Revoke this acceptance? The previous result becomes current again, "
                "which a supervisor has to approve.",
            ),
            translate("WithdrawalBar", "Reason"),
            translate("WithdrawalBar", "Revoke acceptance"),
            translate("WithdrawalBar", "Keep acceptance"),
        )
