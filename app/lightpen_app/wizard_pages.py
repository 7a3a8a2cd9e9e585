"""The pages of the wizard, in the order of the steps."""

from lightpen_app.pages.camera import CameraPage
from lightpen_app.pages.leds import LedsPage
from lightpen_app.pages.page import Page
from lightpen_app.pages.review import ReviewPage
from lightpen_app.pages.start import StartPage
from lightpen_app.pages.swing import SwingPage
from lightpen_app.services import Services


def make_pages(services: Services) -> tuple[Page, ...]:
    """Return all pages."""
    return (
        StartPage(services),
        CameraPage(services),
        LedsPage(services),
        SwingPage(services),
        ReviewPage(services),
    )
