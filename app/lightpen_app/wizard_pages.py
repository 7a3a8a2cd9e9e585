"""The pages of the wizard, in the order of the steps."""

from collections.abc import Iterator

from lightpen_app.look.sounds import Sounds
from lightpen_app.steps.page import Page
from lightpen_app.steps.start.page import StartPage
from lightpen_app.work.workbench import Workbench


def make_pages(workbench: Workbench, sounds: Sounds) -> Iterator[Page]:
    """Make one page after the other, and import its modules only then.

    The first is painted before the others are made.
    """
    yield StartPage(workbench)
    from lightpen_app.steps.camera.page import CameraPage

    yield CameraPage(workbench, sounds)
    from lightpen_app.steps.leds.page import LedsPage

    yield LedsPage(workbench)
    from lightpen_app.steps.swing.page import SwingPage

    yield SwingPage(workbench, sounds)
    from lightpen_app.steps.review.page import ReviewPage

    yield ReviewPage(workbench)
    from lightpen_app.steps.verify.page import VerifyPage

    yield VerifyPage(workbench, sounds)
    from lightpen_app.steps.verify.measure_page import MeasurePage

    yield MeasurePage(workbench, sounds)
    from lightpen_app.steps.history.page import HistoryPage

    yield HistoryPage(workbench)
