"""Overlay of a board image: outline, residuals or uncertainty."""

import numpy as np

from lightpen.intrinsics.calibration import CameraCalibration
from lightpen.intrinsics.coverage import cells_of
from lightpen_app.steps.camera.board_calibration import uncertainty_over_image
from lightpen_app.steps.camera.board_capture import CaptureState
from lightpen_app.widgets.board_view import BoardOverlay


def board_overlay(
    state: CaptureState, found: CameraCalibration | None, *, shows_uncertainty: bool
) -> BoardOverlay:
    """Return the overlay of a calibration, or of the views so far."""
    if found is not None and shows_uncertainty:
        return BoardOverlay(uncertainty=uncertainty_over_image(found))
    if found is not None:
        return _residuals(found)
    if state.capture is None:
        return BoardOverlay()
    points = state.capture.points if state.sought is not None else None
    return BoardOverlay(points, state.outline, state.capture.cells)


def _residuals(found: CameraCalibration) -> BoardOverlay:
    seen = found.views.seen[:, 0]
    pixels, residuals = found.views.pixels[:, 0][seen], found.adjustment.residuals[:, 0]
    arrows = np.concatenate([pixels, residuals[seen]], axis=1)
    return BoardOverlay(cells=cells_of(found.views), arrows=arrows)
