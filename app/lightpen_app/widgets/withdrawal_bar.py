"""Asks why an acceptance is revoked, and a supervisor to sign."""

from lightpen_app.widgets.reason_bar import ReasonBar
from lightpen_app.widgets.translated import Translated


class WithdrawalBar(Translated, ReasonBar):
    """A `ReasonBar` for revoking the acceptance of a tip."""

    def __init__(self) -> None:
        super().__init__()
        self._retranslate()

    def _retranslate(self) -> None:
        self.set_words(
            self.tr(
                "Revoke this acceptance? The previous result becomes current again, "
                "which a supervisor has to approve."
            ),
            self.tr("Reason"),
            self.tr("Revoke acceptance"),
            self.tr("Keep acceptance"),
        )
