"""The pages of the wizard, in the order of the steps."""

from collections.abc import Iterator, Sequence

from lightpen_app.face import Service
from lightpen_app.look.sounds import Sounds
from lightpen_app.steps.start.page import StartPage
from lightpen_app.widgets.page import Page, step_titles
from lightpen_app.work.workbench import Workbench


def make_pages(
    workbench: Workbench, sounds: Sounds, services: Sequence[Service] = ()
) -> Iterator[Page]:
    """Make one page after the other, and import its modules only then.

    The first is painted before the others are made; those of extensions stand before
    the last.
    """
    yield StartPage(workbench, services)
    from lightpen_app.steps.camera.page import CameraPage

    yield CameraPage(workbench, sounds, services)
    from lightpen_app.steps.leds.page import LedsPage

    yield LedsPage(workbench, services)
    from lightpen_app.steps.swing.page import SwingPage

    yield SwingPage(workbench, sounds, services)
    from lightpen_app.steps.review.page import ReviewPage

    yield ReviewPage(workbench, services)
    for each in services:
        yield from each.pages(sounds)
    from lightpen_app.steps.history.page import HistoryPage

    yield HistoryPage(workbench, services)


def page_titles(services: Sequence[Service] = ()) -> tuple[str, ...]:
    """Return the titles of all pages, in their order."""
    *own, last = step_titles().values()
    return (*own, *(title for each in services for title in each.titles()), last)
