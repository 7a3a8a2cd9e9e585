"""The plots of a report, drawn by the plots of the window."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen_app.look.figures import budget_figure
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.result_plots import ArrowPlot, BudgetPlot, MarkPlot

translate = QCoreApplication.translate

HEADROOM = 1.6  # times the largest misfit of a used image; worse ones are at the edge


def charts_of(calibration: CalibrationRecord) -> dict[str, Figure]:
    """Return the plots by their names in the template."""
    return {"budget_plot": _budget(calibration), "misfits": _misfits(calibration)}


def _misfits(calibration: CalibrationRecord) -> Figure:
    """Return the misfit of each image; one that takes no part is apart."""
    misfits = np.array([f.rms_px for f in calibration.frames], dtype=np.float64)
    used = np.array([f.used for f in calibration.frames], dtype=bool)
    top = HEADROOM * float(np.nanmax(misfits[used], initial=1e-6))
    heights = np.where(np.isfinite(misfits), np.minimum(misfits, top), top)
    names = translate("paper", "included"), translate("paper", "excluded")
    plot = MarkPlot(
        Axes(
            translate("paper", "RMS residual per image / px"),
            translate("paper", "image"),
        ),
        names,
    )
    parts = (np.where(part, heights, np.nan) for part in (used, ~used))
    plot.set_data(np.arange(1.0, len(misfits) + 1), *parts)
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


def points_plot(
    touches: Sequence[Mapping[str, Any]],
) -> tuple[dict[str, Figure], dict[str, Any]]:
    """Return a plot of all points with their deviations, from the flattest side."""
    points = np.array([each["point_cam_mm"] for each in touches])
    off = np.array([each["deviation_cam_mm"] or [0, 0, 0] for each in touches])
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    if len(axes) < 2:
        return {}, {"n_points": None}
    flat = (points - middle) @ axes[:2].T
    plot = ArrowPlot(Axes("", "mm", "mm"))
    plot.set_data(None, flat, off @ axes[:2].T)
    plot.mark(flat)
    names = np.array([each["feature"] for each in touches])
    each = list(dict.fromkeys(names.tolist()))
    plot.set_labels(np.array([flat[names == n].mean(axis=0) for n in each]), each)
    return {"points": plot}, {
        "n_points": len(points),
        "enlargement": plot.scale(),
        "largest_deviation": float(np.linalg.norm(off, axis=1).max()),
    }
