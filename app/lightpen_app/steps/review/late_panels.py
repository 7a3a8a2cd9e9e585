"""The panels of the review, each imported when it is first seen.

What draws plots takes a fifth of the time to the first window, which has none.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lightpen_app.steps.review.images_panel import ImagesPanel
    from lightpen_app.steps.review.plots_panel import PlotsPanel


def make_images_panel() -> "ImagesPanel":
    """Return the panel of the images."""
    from lightpen_app.steps.review.images_panel import ImagesPanel

    return ImagesPanel()


def make_residuals_panel() -> "PlotsPanel":
    """Return the panel of the residuals."""
    from lightpen_app.steps.review.plots_panel import ResidualsPanel

    return ResidualsPanel()


def make_uncertainty_panel() -> "PlotsPanel":
    """Return the panel of U and its budget."""
    from lightpen_app.steps.review.plots_panel import UncertaintyPanel

    return UncertaintyPanel()


def make_methods_panel() -> "PlotsPanel":
    """Return the panel that compares the methods."""
    from lightpen_app.steps.review.plots_panel import MethodsPanel

    return MethodsPanel()
