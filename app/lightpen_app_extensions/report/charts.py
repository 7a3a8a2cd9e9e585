"""The plots of a calibration, drawn by the plots of the window."""

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen_app.look.figures import budget_figure
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.plots import Curve
from lightpen_app.widgets.result_plots import (
    ArrowPlot,
    BarPlot,
    BudgetPlot,
    MarkPlot,
    PosturePlot,
)
from lightpen_app_extensions.report.reestimated import ReestimatedPoses

translate = QCoreApplication.translate

HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge


def charts_of(
    calibration: CalibrationRecord, reestimated: ReestimatedPoses | None
) -> dict[str, Figure]:
    """Return the plots by their names in the template.

    Some need the reestimated images.
    """
    plots = {
        "budget_plot": _budget(calibration),
        "misfits": _misfits(calibration),
        "led_plot": _leds(calibration),
    }
    if reestimated is None:
        return plots
    return plots | {
        "postures": _postures(reestimated),
        "residuals": _residuals(reestimated),
    }


def _misfits(calibration: CalibrationRecord) -> Figure:
    """Return the misfit of each image; one that takes no part is apart."""
    misfits = np.array([f.rms_px for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    top = HEADROOM * float(np.nanmax(misfits[used], initial=1e-6))
    heights = np.where(np.isfinite(misfits), np.minimum(misfits, top), top)
    names = translate("paper", "included"), translate("paper", "excluded")
    plot = MarkPlot(
        Axes(translate("paper", "RMS residual per image / px"), _image_number()),
        [Curve(name, name) for name in names],
    )
    parts = (np.where(part, heights, np.nan) for part in (used, ~used))
    plot.set_data(np.arange(1.0, len(misfits) + 1), *parts)
    return plot


def _leds(calibration: CalibrationRecord) -> Figure:
    """Return the residuals of each LED."""
    rms = np.array([led.rms_px for led in calibration.leds], dtype=np.float64)
    means = np.array([led.mean_px for led in calibration.leds], dtype=np.float64)
    names = (
        translate("paper", "rms"),
        translate("paper", "mean x"),
        translate("paper", "mean y"),
    )
    axes = Axes(translate("paper", "Residuals by LED / px"), translate("paper", "LED"))
    plot = BarPlot(axes, [Curve(name, name) for name in names], "led")
    plot.set_data([str(led.led) for led in calibration.leds], rms, *means.T)
    return plot


def _budget(calibration: CalibrationRecord) -> Figure:
    """Return the parts of U along its weakest direction."""
    plot = BudgetPlot(
        Axes(translate("paper", "U (k = 2) by source, weakest direction / mm"))
    )
    plot.set_value(
        budget_figure(
            (
                (share.name, share.weakest_expanded_uncertainty_mm, share.assumed)
                for share in calibration.uncertainty.shares
            ),
            calibration.weakest_direction.expanded_uncertainty_mm,
            calibration.verdict.limits.max_uncertainty_mm,
        )
    )
    return plot


def _residuals(reestimated: ReestimatedPoses) -> Figure:
    """Return the residuals as enlarged arrows at their image positions."""
    plot = ArrowPlot(Axes(""))
    plot.set_data(None, reestimated.points, reestimated.residuals)
    title = translate("paper", "Residuals over the image \xd7 {0}")
    plot.set_axes(Axes(title.format(f"{plot.scale():g}"), "x / px", "y / px"))
    return plot


def _postures(reestimated: ReestimatedPoses) -> Figure:
    """Return the plot of the pen tilts from above, with the camera below."""
    title = translate("paper", "Postures: tilt / \xb0")
    plot = PosturePlot(Axes(title, translate("paper", "towards the camera")))
    plot.set_data(reestimated.tilts, reestimated.directions)
    return plot


def _image_number() -> str:
    return translate("paper", "image")
