"""Verification and measuring in the window, with their pages."""

from collections.abc import Iterator

from PySide6.QtCore import QCoreApplication
from typing_extensions import override

from lightpen_app.look.sounds import Sounds
from lightpen_app.widgets.page import Page
from lightpen_app_extensions.measure.service import MeasureService

translate = QCoreApplication.translate


class MeasureFace(MeasureService):
    """Verifies tips and measures parts, each on a page."""

    @override
    def titles(self) -> tuple[str, ...]:
        return translate("VerifyPage", "Verify"), translate("MeasurePage", "Measure")

    @override
    def pages(self, sounds: Sounds) -> Iterator[Page]:
        from lightpen_app_extensions.measure.verify_page import VerifyPage

        yield VerifyPage(self, sounds)
        from lightpen_app_extensions.measure.measure_page import MeasurePage

        yield MeasurePage(self, sounds)
