"""The pages of the wizard, in the order of the steps."""

from lightpen_app.look.sounds import Sounds
from lightpen_app.steps.camera.page import CameraPage
from lightpen_app.steps.history.page import HistoryPage
from lightpen_app.steps.leds.page import LedsPage
from lightpen_app.steps.page import Page
from lightpen_app.steps.review.page import ReviewPage
from lightpen_app.steps.start.page import StartPage
from lightpen_app.steps.swing.page import SwingPage
from lightpen_app.steps.verify.measure_page import MeasurePage
from lightpen_app.steps.verify.page import VerifyPage
from lightpen_app.work.workbench import Workbench


def make_pages(workbench: Workbench, sounds: Sounds) -> tuple[Page, ...]:
    """Return all pages."""
    return (
        StartPage(workbench, sounds),
        CameraPage(workbench, sounds),
        LedsPage(workbench),
        SwingPage(workbench, sounds),
        ReviewPage(workbench),
        VerifyPage(workbench, sounds),
        MeasurePage(workbench, sounds),
        HistoryPage(workbench),
    )
