"""The plots of a report, drawn by the plots of the window."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen_app.look.figures import budget_figure
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.result_plots import ArrowPlot, BudgetPlot

translate = QCoreApplication.translate


def budget_plot(calibration: CalibrationRecord) -> Figure:
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
