"""The words for what the core says in codes, in the language that is chosen."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.detection.reasons import Reason
from lightpen.estimation.verdict import Grade
from lightpen.messages import Argument, Code, Message
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS
from lightpen.model.posture import Posture
from lightpen.swing.preparation import Lack
from lightpen.swing.state import Pause, Phase

CONTEXT = "phrases"
MANY_SIDES = 4  # of eight; more are not told one by one
WORTH_A_TURN = math.radians(15)  # about the pen's own axis, to be told of

if TYPE_CHECKING:

    def QT_TRANSLATE_NOOP(context: str, text: str) -> str:  # noqa: N802 - Qt's
        """Return the text; PySide6 gives it the type of any object."""
else:
    from PySide6.QtCore import QT_TRANSLATE_NOOP


@dataclass(frozen=True)
class Phrase:
    """What an operator is told.

    Attributes
    ----------
    short : str
        A few words, to be read from a distance.
    hint : str
        A sentence or two: likely why, and what to do.
    """

    short: str
    hint: str = ""


# lupdate finds the texts by this macro.
_PHRASES: dict[Code, tuple[str, str]] = {
    Code.SHOW_PEN: (
        QT_TRANSLATE_NOOP("phrases", "Show the pen"),
        QT_TRANSLATE_NOOP("phrases", "Hold it so that the camera sees its LEDs."),
    ),
    Code.SEAT_TIP: (
        QT_TRANSLATE_NOOP("phrases", "Seat the tip"),
        QT_TRANSLATE_NOOP("phrases", "Press the tip into the cone and keep it there."),
    ),
    Code.SWING_TO_SEAT: (
        QT_TRANSLATE_NOOP("phrases", "Seat and swing"),
        QT_TRANSLATE_NOOP(
            "phrases", "Press the tip into the cone and swing the pen gently."
        ),
    ),
    Code.HOLD_STILL: (
        QT_TRANSLATE_NOOP("phrases", "Seated"),
        QT_TRANSLATE_NOOP("phrases", "The tip rests in the cone. Keep it pressed in."),
    ),
    Code.STARTS_IN: (
        QT_TRANSLATE_NOOP("phrases", "Starts in {0}"),
        QT_TRANSLATE_NOOP("phrases", "Keep the tip pressed into the cone."),
    ),
    Code.LEAN_TO_YOUR_RIGHT: (
        QT_TRANSLATE_NOOP("phrases", "Lean RIGHT"),
        QT_TRANSLATE_NOOP(
            "phrases", "To YOUR right: it tells the program where you stand."
        ),
    ),
    Code.FOLLOW_ARROW: (
        QT_TRANSLATE_NOOP("phrases", "Follow the arrow"),
        QT_TRANSLATE_NOOP("phrases", "Keep the tip pressed into the cone."),
    ),
    Code.FEW_LEDS: (
        QT_TRANSLATE_NOOP("phrases", "Show the LEDs"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "LEDs seen: {0}, needed: {1}. A finger may cover them; or lean back a "
            "little.",
        ),
    ),
    Code.TOO_FAST: (
        QT_TRANSLATE_NOOP("phrases", "Slower"),
        QT_TRANSLATE_NOOP("phrases", "The LEDs are smeared. Swing the pen slowly."),
    ),
    Code.BAD_FIT: (
        QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "{0} px in this image, {1} px in the others. A finger or a reflection may "
            "cover part of an LED.",
        ),
    ),
    Code.TIP_SLIPPED: (
        QT_TRANSLATE_NOOP("phrases", "Tip slipped"),
        QT_TRANSLATE_NOOP(
            "phrases", "Images dropped: {0}. Press the tip into the cone again."
        ),
    ),
    Code.PEN_LOST: (
        QT_TRANSLATE_NOOP("phrases", "Pen not seen"),
        QT_TRANSLATE_NOOP(
            "phrases", "Turn its LEDs to the camera; nothing is lost meanwhile."
        ),
    ),
    Code.PEN_LIFTED: (
        QT_TRANSLATE_NOOP("phrases", "Paused"),
        QT_TRANSLATE_NOOP("phrases", "The pen is lifted. Put the tip back to go on."),
    ),
    Code.TIP_ELSEWHERE: (
        QT_TRANSLATE_NOOP("phrases", "Tip not in place"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "It rests {0} mm from where it was. Put it back into the cone; check that "
            "the cone is clamped.",
        ),
    ),
    Code.PAUSED: (
        QT_TRANSLATE_NOOP("phrases", "Paused"),
        QT_TRANSLATE_NOOP("phrases", "Press Space to go on."),
    ),
    Code.SOLVING: (
        QT_TRANSLATE_NOOP("phrases", "Captured"),
        QT_TRANSLATE_NOOP("phrases", "The tip is being computed. Put the pen down."),
    ),
    Code.TOO_FEW_IMAGES: (
        QT_TRANSLATE_NOOP("phrases", "More images"),
        QT_TRANSLATE_NOOP("phrases", "Images kept: {0} of at least {1}."),
    ),
    Code.TOO_LITTLE_TILT: (
        QT_TRANSLATE_NOOP("phrases", "Lean further"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "Too little tilt {1}. Lean the pen further that way. Images still "
            "needed: about {0}.",
        ),
    ),
    Code.NOT_UPRIGHT: (
        QT_TRANSLATE_NOOP("phrases", "Hold it upright"),
        QT_TRANSLATE_NOOP("phrases", "Images of the upright pen still needed: {0}."),
    ),
    Code.UNKNOWN: (
        QT_TRANSLATE_NOOP("phrases", "Not known yet"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "The images do not tell yet where the tip is. Lean the pen to all sides.",
        ),
    ),
    Code.UNCERTAIN: (
        QT_TRANSLATE_NOOP("phrases", "Not certain enough"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "U (k = 2) of the tip is {0} mm, the limit {1} mm. Capture more images in "
            "postures that differ.",
        ),
    ),
    Code.HALVES_DIFFER: (
        QT_TRANSLATE_NOOP("phrases", "Halves differ"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "Odd and even images put the tip {0} mm apart, {1} mm is usual. The tip "
            "may have moved: repeat the swing with the tip pressed in.",
        ),
    ),
    Code.MANY_DROPPED: (
        QT_TRANSLATE_NOOP("phrases", "Many images dropped"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "{0} of {1} images do not take part. Review has their reasons; repeat the "
            "swing if the tip slipped.",
        ),
    ),
    Code.LEDS_OFF: (
        QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "The LED file is off by {0} mm a coordinate, which alone makes U (k = 2) "
            "{1} mm. Is this the LED file of this pen? More images hardly help.",
        ),
    ),
    Code.LED_DISPLACED: (
        QT_TRANSLATE_NOOP("phrases", "LED out of place"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "LED {0} sits {1} mm off its place in the LED file. Is this the LED file "
            "of this pen?",
        ),
    ),
    Code.LEDS_MISFIT: (
        QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
        QT_TRANSLATE_NOOP(
            "phrases",
            "The residuals are {0} px, {1} px or less is usual. Is this the LED file "
            "of this pen, and the intrinsics file of this camera and lens?",
        ),
    ),
    Code.NO_TIP: (QT_TRANSLATE_NOOP("phrases", "No tip found"), "{0}"),
    Code.GOOD: (
        QT_TRANSLATE_NOOP("phrases", "Good"),
        QT_TRANSLATE_NOOP(
            "phrases", "U (k = 2) of the tip is {0} mm. Accept it at the screen."
        ),
    ),
}
_DECIMALS: dict[Code, tuple[int, ...]] = {
    Code.BAD_FIT: (3, 3),
    Code.TIP_ELSEWHERE: (2,),
    Code.UNCERTAIN: (4, 4),
    Code.HALVES_DIFFER: (4, 4),
    Code.LEDS_OFF: (3, 4),
    Code.LED_DISPLACED: (0, 2),
    Code.LEDS_MISFIT: (2, 2),
    Code.GOOD: (4,),
}
_LACKS: dict[Lack, str] = {
    Lack.STATION: QT_TRANSLATE_NOOP("phrases", "Enter the name of the station."),
    Lack.OPERATOR: QT_TRANSLATE_NOOP("phrases", "Enter the name of the operator."),
    Lack.PEN: QT_TRANSLATE_NOOP("phrases", "Enter the serial number of the pen."),
    Lack.TIP: QT_TRANSLATE_NOOP("phrases", "Enter the name of the probe tip."),
    Lack.CONE: QT_TRANSLATE_NOOP("phrases", "Enter the name of the cone."),
    Lack.SOURCE_PLACE: QT_TRANSLATE_NOOP(
        "phrases", "Choose the folder of the recorded images."
    ),
    Lack.IMAGES: QT_TRANSLATE_NOOP("phrases", "No image has come from the camera yet."),
    Lack.CAMERA_FILE: QT_TRANSLATE_NOOP("phrases", "Open the intrinsics file."),
    Lack.IMAGE_SIZE: QT_TRANSLATE_NOOP(
        "phrases", "The intrinsics file is for images of another size."
    ),
    Lack.PEN_FILE: QT_TRANSLATE_NOOP("phrases", "Open the LED geometry file."),
    Lack.SAVED_LEDS: QT_TRANSLATE_NOOP(
        "phrases", "Save or discard the changes of the LED table."
    ),
}
_REASONS: dict[Reason, str] = {
    Reason.NONE: "",
    Reason.UNREADABLE: QT_TRANSLATE_NOOP("phrases", "unreadable"),
    Reason.WRONG_SIZE: QT_TRANSLATE_NOOP("phrases", "wrong size"),
    Reason.EMPTY: QT_TRANSLATE_NOOP("phrases", "no LED seen"),
    Reason.BLURRED: QT_TRANSLATE_NOOP("phrases", "blurred"),
    Reason.TOO_FEW_LEDS: QT_TRANSLATE_NOOP("phrases", "too few LEDs"),
    Reason.NOT_THE_PEN: QT_TRANSLATE_NOOP("phrases", "spots do not fit the pen"),
    Reason.AMBIGUOUS: QT_TRANSLATE_NOOP("phrases", "ambiguous"),
    Reason.MISFIT: QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
    Reason.SLIPPED: QT_TRANSLATE_NOOP("phrases", "tip slipped"),
    Reason.TAKEN_OUT: QT_TRANSLATE_NOOP("phrases", "taken out"),
}
# A word for a sign to stand beside, read from a distance.
_PHASES: dict[Phase, str] = {
    Phase.WAIT: QT_TRANSLATE_NOOP("phrases", "WAITING"),
    Phase.SEEN: QT_TRANSLATE_NOOP("phrases", "PEN SEEN"),
    Phase.SETTLED: QT_TRANSLATE_NOOP("phrases", "SEATED"),
    Phase.COUNTDOWN: QT_TRANSLATE_NOOP("phrases", "READY"),
    Phase.CAPTURING: QT_TRANSLATE_NOOP("phrases", "CAPTURING"),
    Phase.PAUSED: QT_TRANSLATE_NOOP("phrases", "PAUSED"),
    Phase.SOLVING: QT_TRANSLATE_NOOP("phrases", "COMPUTING"),
    Phase.VERDICT: QT_TRANSLATE_NOOP("phrases", "NO TIP"),
}
_PAUSES: dict[Pause, str] = {
    Pause.LOST: QT_TRANSLATE_NOOP("phrases", "PEN LOST"),
    Pause.LIFTED: QT_TRANSLATE_NOOP("phrases", "LIFTED"),
    Pause.ELSEWHERE: QT_TRANSLATE_NOOP("phrases", "TIP MOVED"),
}
_GRADES: dict[Grade, str] = {
    Grade.PASS: QT_TRANSLATE_NOOP("phrases", "PASS"),
    Grade.CHECK: QT_TRANSLATE_NOOP("phrases", "CHECK"),
    Grade.REPEAT: QT_TRANSLATE_NOOP("phrases", "REPEAT"),
}
# What to do for a posture in each direction; as `_SIDES`.
_LEANS = (
    QT_TRANSLATE_NOOP("phrases", "Lean right"),
    QT_TRANSLATE_NOOP("phrases", "Away, right"),
    QT_TRANSLATE_NOOP("phrases", "Lean away"),
    QT_TRANSLATE_NOOP("phrases", "Away, left"),
    QT_TRANSLATE_NOOP("phrases", "Lean left"),
    QT_TRANSLATE_NOOP("phrases", "To you, left"),
    QT_TRANSLATE_NOOP("phrases", "Lean to you"),
    QT_TRANSLATE_NOOP("phrases", "To you, right"),
)
# How far, by the ring of the dial.
_TILTS = (
    QT_TRANSLATE_NOOP("phrases", "Keep the tip pressed into the cone."),
    QT_TRANSLATE_NOOP("phrases", "A little. Keep the tip pressed in."),
    QT_TRANSLATE_NOOP("phrases", "Far. Keep the tip pressed in."),
)
# From the operator's right, against the clock seen from above.
_SIDES = (
    QT_TRANSLATE_NOOP("phrases", "to the right"),
    QT_TRANSLATE_NOOP("phrases", "away to the right"),
    QT_TRANSLATE_NOOP("phrases", "away from you"),
    QT_TRANSLATE_NOOP("phrases", "away to the left"),
    QT_TRANSLATE_NOOP("phrases", "to the left"),
    QT_TRANSLATE_NOOP("phrases", "towards you to the left"),
    QT_TRANSLATE_NOOP("phrases", "towards you"),
    QT_TRANSLATE_NOOP("phrases", "towards you to the right"),
)


def phrase(message: Message, heading: float | None = None) -> Phrase:
    """Return the words of a message.

    Parameters
    ----------
    message : Message
    heading : float, optional
        The operator's right as the camera sees it, rad; without it directions are
        told as from behind the camera.
    """
    short, hint = map(_translated, _PHRASES[message.code])
    arguments = list(message.arguments)
    if message.code is Code.TOO_LITTLE_TILT:
        n_images, *directions = arguments
        sides = sides_text((int(each) for each in directions), heading)
        arguments = [n_images, sides]
    words = _formatted(message.code, arguments)
    return Phrase(short.format(*words), hint.format(*words))


def lean_phrase(target: Posture, present: Posture | None, heading: float) -> Phrase:
    """Return the words that lead to a posture.

    Parameters
    ----------
    target : Posture
    present : Posture or None
        Where the pen is, if it is seen.
    heading : float
        The operator's right as the camera sees it, rad.
    """
    ring = int(np.digitize(target.tilt, TILT_RINGS))
    eighth = 2 * math.pi / N_DIRECTIONS
    side = round((target.direction - heading) / eighth) % N_DIRECTIONS
    upright = QT_TRANSLATE_NOOP("phrases", "Upright")
    short, hint = _translated(_LEANS[side] if ring else upright), _TILTS[ring]
    if present is not None and abs(target.turn - present.turn) > WORTH_A_TURN:
        hint = (
            QT_TRANSLATE_NOOP("phrases", "Turn it counter-clockwise, seen from above.")
            if target.turn > present.turn
            else QT_TRANSLATE_NOOP("phrases", "Turn it clockwise, seen from above.")
        )
    return Phrase(short, _translated(hint))


def sides_text(directions: Iterable[int], heading: float | None = None) -> str:
    """Return where directions of the dial (0 to 7, camera's view) lie for the operator.

    See `phrase` for ``heading``.
    """
    turned = round((heading or 0.0) / (2 * math.pi / N_DIRECTIONS))
    directions = set(directions)
    if len(directions) > MANY_SIDES:
        return _translated(QT_TRANSLATE_NOOP("phrases", "to most sides"))
    sides = sorted((direction - turned) % N_DIRECTIONS for direction in directions)
    comma = _translated(QT_TRANSLATE_NOOP("phrases", ", "))
    return comma.join(_translated(_SIDES[side]) for side in sides)


def n_images_text(n_images: int) -> str:
    """Return how many images, such as "12 images"."""
    if n_images == 1:
        return _translated(QT_TRANSLATE_NOOP("phrases", "1 image"))
    many = _translated(QT_TRANSLATE_NOOP("phrases", "{0} images"))
    return many.format(n_images)


def lack_text(lack: Lack) -> str:
    """Return what to do about something that is missing, a sentence."""
    return _translated(_LACKS[lack])


def reason_text(reason: Reason) -> str:
    """Return why an image does not take part, a few words; empty for one that does."""
    return _translated(_REASONS[reason])


def phase_text(phase: Phase, pause: Pause = Pause.NONE) -> str:
    """Return the word of where a swing stands; a pause has one of its own."""
    return _translated(_PAUSES.get(pause, _PHASES[phase]))


def grade_text(grade: Grade) -> str:
    """Return the word of a verdict."""
    return _translated(_GRADES[grade])


def _formatted(code: Code, arguments: list[Argument]) -> list[str]:
    decimals = _DECIMALS.get(code, ())
    return [
        f"{argument:.{decimals[i]}f}"
        if i < len(decimals) and isinstance(argument, int | float)
        else str(argument)
        for i, argument in enumerate(arguments)
    ]


def _translated(text: str) -> str:
    return QCoreApplication.translate(CONTEXT, text) if text else ""
