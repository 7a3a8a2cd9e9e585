"""The plots of a calibration, drawn by the plots of the window."""

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen.record.recomputing import ReestimatedPoses
from lightpen_app.look.figures import budget_figure
from lightpen_app.look.words import AXES, MICROMETRES
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.plots import Curve, TracePlot
from lightpen_app.widgets.result_plots import (
    FARTHEST,
    ArrowPlot,
    BarPlot,
    BudgetPlot,
    Histogram,
    LinePlot,
    PosturePlot,
)

translate = QCoreApplication.translate

HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge
STEADY = 8.0  # times the last U, beyond which a tip by few images is left out


def charts_of(
    calibration: CalibrationRecord, reestimated: ReestimatedPoses | None
) -> dict[str, Figure]:
    """Return the plots by their names in the template.

    Some need the reestimated images.
    """
    plots = {
        "budget_plot": _budget(calibration),
        "misfits": _misfits(calibration),
        "tips": _tips(calibration),
        "led_plot": _leds(calibration),
    }
    coverage = _coverage(calibration)
    if reestimated is None:
        return plots | {"coverage_alone": coverage}
    limit = calibration.verdict.limits.max_uncertainty_mm
    return plots | {
        "running": _running(reestimated, np.array(calibration.tip_pen_mm)),
        "certainty": _certainty(reestimated, limit),
        "postures": _postures(reestimated),
        "coverage": coverage,
        "residuals": _residuals(reestimated),
        "histogram": _histogram(reestimated),
    }


def _misfits(calibration: CalibrationRecord) -> Figure:
    """Return the misfit of each image; one that takes no part is apart."""
    misfits = np.array([f.rms_px for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    top = HEADROOM * float(np.nanmax(misfits[used], initial=1e-6))
    heights = np.where(np.isfinite(misfits), np.minimum(misfits, top), top)
    names = translate("paper", "included"), translate("paper", "excluded")
    plot = LinePlot(
        Axes(translate("paper", "RMS residual per image / px"), _image_number()),
        [Curve(name, name) for name in names],
        is_joined=False,
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


def _tips(calibration: CalibrationRecord) -> Figure:
    """Return the tip by each image minus the cone, camera frame."""
    tips = np.array([f.tip_cam_mm for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    away = MICROMETRES * (tips[used] - np.array(calibration.cone_cam_mm))
    title = translate("paper", "Tip per image relative to the cone / µm")
    curves = [Curve(name, name) for name in "uvw"]
    plot = LinePlot(Axes(title, _image_number()), curves, is_joined=False)
    numbers = 1.0 + np.flatnonzero(used).astype(np.float64)
    plot.set_data(numbers, *away.T)
    return plot


def _running(reestimated: ReestimatedPoses, tip: FloatArray) -> Figure:
    """Return the convergence of the tip (3,), mm, with the images."""
    title = translate("paper", "Tip from the first n images minus result / µm")
    return _trace(title, reestimated, reestimated.tips - tip)


def _certainty(reestimated: ReestimatedPoses, limit: float) -> Figure:
    """Return U (k = 2) over the number of images, with its limit, mm."""
    title = translate("paper", "U (k = 2) from the first n images / µm")
    return _trace(title, reestimated, reestimated.uncertainties, limit)


def _trace(
    title: str,
    reestimated: ReestimatedPoses,
    values: FloatArray,
    limit: float | None = None,
) -> TracePlot:
    """Return values (M, 3), mm, of running tips that are certain enough to draw.

    With a limit, mm, it is drawn, and zero is shown.
    """
    worst = reestimated.uncertainties.max(axis=1)
    steady = worst <= STEADY * worst[-1]
    curves = [Curve(axis, axis) for axis in AXES]
    axes = Axes(title, _image_number())
    plot = TracePlot(axes, curves, y_zero=limit is not None)
    if limit is not None:
        plot.set_limit(MICROMETRES * limit)
    numbers = reestimated.numbers[steady].astype(np.float64)
    plot.set_data(numbers, *(MICROMETRES * values[steady]).T)
    return plot


def _residuals(reestimated: ReestimatedPoses) -> Figure:
    """Return the residuals as enlarged arrows at their image positions."""
    plot = ArrowPlot(Axes(""))
    plot.set_data(None, reestimated.points, reestimated.residuals)
    title = translate("paper", "Residuals over the image \xd7 {0}")
    plot.set_axes(Axes(title.format(f"{plot.scale():g}"), "x / px", "y / px"))
    return plot


def _histogram(reestimated: ReestimatedPoses) -> Figure:
    """Return the histogram of the residuals with the normal curve."""
    title = translate("paper", "Histogram of residuals with normal fit")
    plot = Histogram(Axes(title, translate("paper", "residual / px")), "residual_px")
    plot.set_data(reestimated.residuals.ravel())
    return plot


def _postures(reestimated: ReestimatedPoses) -> Figure:
    """Return the plot of the pen tilts from above, with the camera below."""
    plot = PosturePlot(_of_dial(translate("paper", "Postures: tilt / \xb0")))
    plot.set_data(reestimated.tilts, reestimated.directions)
    return plot


def _coverage(calibration: CalibrationRecord) -> Figure:
    """Return the number of images in each field of the dial."""
    coverage = calibration.coverage
    inner, outer = np.degrees(TILT_RINGS)
    places, counts = [(0.0, 0.0)], [coverage.upright]
    for radius, of_ring in (
        ((inner + outer) / 2, coverage.leaning),
        ((outer + FARTHEST) / 2, coverage.leaning_far),
    ):
        angles = 2 * np.pi * np.arange(N_DIRECTIONS) / N_DIRECTIONS
        places += zip(radius * np.cos(angles), radius * np.sin(angles), strict=True)
        counts += of_ring
    plot = PosturePlot(_of_dial(translate("paper", "Images per field")))
    plot.set_data(np.zeros(0), np.zeros(0))
    plot.set_labels(np.array(places), list(map(str, counts)))
    return plot


def _of_dial(title: str) -> Axes:
    return Axes(title, translate("paper", "towards the camera"))


def _image_number() -> str:
    return translate("paper", "image")
