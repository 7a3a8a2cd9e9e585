"""The pages of the wizard, in the order of the steps."""

from lightpen_app.steps.camera.page import CameraPage
from lightpen_app.steps.leds.page import LedsPage
from lightpen_app.steps.page import Page
from lightpen_app.steps.review.page import ReviewPage
from lightpen_app.steps.services import Services
from lightpen_app.steps.start.page import StartPage
from lightpen_app.steps.swing.page import SwingPage


def make_pages(services: Services) -> tuple[Page, ...]:
    """Return all pages."""
    return (
        StartPage(services),
        CameraPage(services),
        LedsPage(services),
        SwingPage(services),
        ReviewPage(services),
    )
