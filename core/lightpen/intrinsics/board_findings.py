"""Findings on the board of a calibration: stretched, sheared, bent, or implausible."""

import numpy as np

from lightpen.arrays import BoolArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.intrinsics.boards import Board
from lightpen.intrinsics.views import BoardTolerances
from lightpen.messages import Message, message

CONTRADICTED = 3.0  # standard deviations
STRETCHED = 1e-3  # relative: printers stretch by more
RELEASED, RELEASED_MM = 0.1, 5.0  # tolerances of a contradicted board
MOST_BENT = 0.02  # of the longer side of a board; paper in a hand bends less
USUAL_SIDES = 10.0, 3000.0  # mm, of a board


def released_tolerances(stated: BoardTolerances) -> BoardTolerances:
    """Return tolerances wide enough for the views to determine the board."""
    return BoardTolerances(RELEASED_MM, RELEASED, stated.scale)


def board_contradictions(fitted: BoardFit, tolerances: BoardTolerances) -> BoolArray:
    """Tell which errors of the board contradict its tolerances, (5,)."""
    sigmas = np.sqrt(np.diag(fitted.covariance)[fitted.of_shape])
    priors = np.repeat([tolerances.squareness, tolerances.flatness], [2, 3])
    learned = np.sqrt(np.maximum(priors**2 - sigmas**2, 1e-30))
    return np.asarray(np.abs(fitted.state.shape) > CONTRADICTED * learned)


def messages_on_board(
    fitted: BoardFit, tolerances: BoardTolerances, suspected: BoolArray
) -> tuple[Message, ...]:
    """Return messages on a board that contradicts its tolerances.

    ``suspected`` (5,) are the errors that contradicted them before lenses and single
    views were considered.
    """
    denied = suspected & board_contradictions(fitted, tolerances)
    values = fitted.state.shape
    remarks = []
    stretch, shear = values[:2].tolist()
    if denied[:2].any() and max(abs(stretch), abs(shear)) > STRETCHED:
        remarks.append(
            message(
                "intrinsics.board-stretched",
                board=fitted.board.name,
                stretch=stretch,
                shear=float(np.degrees(shear)),
            )
        )
    if denied[2:].any():
        remarks.append(
            message(
                "intrinsics.board-bent",
                bend=float(np.abs(values[2:]).max()),
                stated=tolerances.flatness,
            )
        )
    return tuple(remarks)


def require_plausible_bend(fitted: BoardFit) -> None:
    """Raise `CalibrationError` at a bend no board has: something else is wrong."""
    bend = float(np.abs(fitted.state.shape[2:]).max())
    longer = 2 * float(np.abs(fitted.board.points[:, :2]).max())
    if bend > MOST_BENT * longer:
        raise CalibrationError(
            "intrinsics.bend-implausible", bend=bend, board=fitted.board.name
        )


def messages_on_size(board: Board) -> tuple[Message, ...]:
    """Return the question whether lengths were in another unit."""
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    least, most = USUAL_SIDES
    if least <= longer <= most:
        return ()
    return (
        message("intrinsics.size-implausible", pitch=board.pitch, side=longer / 1000),
    )
