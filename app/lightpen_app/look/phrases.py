"""Phrases for codes of the core, in the selected language."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from PySide6.QtCore import QCoreApplication

from lightpen.detection.reasons import Reason
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.messages import MOST_SIDES, SIDES, Code, Message
from lightpen.model.coverage import N_DIRECTIONS, TILT_RINGS, Decision
from lightpen.model.names import Origin
from lightpen.model.rigid import Posture
from lightpen.swing.capture.state import Pause, Phase
from lightpen.swing.preparation import MissingInput
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.translatable import QT_TRANSLATE_NOOP

CONTEXT = "phrases"
WORTH_A_TURN = math.radians(15)  # about the pen's own axis, to be mentioned


@dataclass(frozen=True)
class Instruction:
    """Instruction to an operator."""

    short: str  # a few words, to be read from a distance
    hint: str = ""  # a sentence or two: likely why, and what to do


# lupdate finds the texts by this macro.
_SHORTS: dict[Code, str] = {
    Code.SHOW_PEN: QT_TRANSLATE_NOOP("phrases", "Hold the pen in view"),
    Code.SEAT_TIP: QT_TRANSLATE_NOOP("phrases", "Seat the tip"),
    Code.SWING_TO_SEAT: QT_TRANSLATE_NOOP("phrases", "Seat and swing"),
    Code.HOLD_STILL: QT_TRANSLATE_NOOP("phrases", "Seated"),
    Code.STARTS_IN: QT_TRANSLATE_NOOP("phrases", "Starts in {seconds}"),
    Code.HOLD_UPRIGHT: QT_TRANSLATE_NOOP("phrases", "Hold it upright"),
    Code.LEAN_TO_YOUR_RIGHT: QT_TRANSLATE_NOOP("phrases", "Tilt RIGHT"),
    Code.FOLLOW_ARROW: QT_TRANSLATE_NOOP("phrases", "Follow the arrow"),
    Code.FEW_LEDS: QT_TRANSLATE_NOOP("phrases", "Show the LEDs"),
    Code.TOO_FAST: QT_TRANSLATE_NOOP("phrases", "Slower"),
    Code.BAD_FIT: QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
    Code.TIP_SLIPPED: QT_TRANSLATE_NOOP("phrases", "Tip slipped"),
    Code.PEN_LOST: QT_TRANSLATE_NOOP("phrases", "Pen not detected"),
    Code.PEN_LIFTED: QT_TRANSLATE_NOOP("phrases", "Paused"),
    Code.TIP_ELSEWHERE: QT_TRANSLATE_NOOP("phrases", "Tip not in place"),
    Code.IMAGES_READ: QT_TRANSLATE_NOOP("phrases", "Loading"),
    Code.PAUSED: QT_TRANSLATE_NOOP("phrases", "Paused"),
    Code.SOLVING: QT_TRANSLATE_NOOP("phrases", "Capture ended"),
    Code.TOO_FEW_IMAGES: QT_TRANSLATE_NOOP("phrases", "More images"),
    Code.TOO_LITTLE_TILT: QT_TRANSLATE_NOOP("phrases", "Tilt further"),
    Code.NOT_UPRIGHT: QT_TRANSLATE_NOOP("phrases", "Hold it upright"),
    Code.UNKNOWN: QT_TRANSLATE_NOOP("phrases", "Not determined yet"),
    Code.UNCERTAIN: QT_TRANSLATE_NOOP("phrases", "Uncertainty too large"),
    Code.HALVES_DIFFER: QT_TRANSLATE_NOOP("phrases", "Odd and even differ"),
    Code.MANY_DROPPED: QT_TRANSLATE_NOOP("phrases", "Many images rejected"),
    Code.MANY_EXCLUDED: QT_TRANSLATE_NOOP("phrases", "Many images excluded"),
    Code.LEDS_OFF: QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
    Code.LED_DISPLACED: QT_TRANSLATE_NOOP("phrases", "LED displaced"),
    Code.LEDS_MISFIT: QT_TRANSLATE_NOOP("phrases", "LEDs do not fit"),
    Code.CAMERA_TILTS: QT_TRANSLATE_NOOP("phrases", "Uncertainty too large"),
    Code.FILE_UNCERTAIN: QT_TRANSLATE_NOOP("phrases", "Uncertainty too large"),
    Code.FILE_ASSUMED: QT_TRANSLATE_NOOP("phrases", "Uncertainty too large"),
    Code.FILE_CONTRADICTED: QT_TRANSLATE_NOOP("phrases", "File does not fit"),
    Code.CAMERA_MOVED: QT_TRANSLATE_NOOP("phrases", "Camera or cone moved"),
    Code.NO_TEMPERATURE: QT_TRANSLATE_NOOP("phrases", "Temperature not measured"),
    Code.NOT_SIMULTANEOUS: QT_TRANSLATE_NOOP("phrases", "Cameras not synchronised"),
    Code.OUT_OF_REACH: QT_TRANSLATE_NOOP("phrases", "Uncertainty of files too large"),
    Code.TIP_CHANGED: QT_TRANSLATE_NOOP("phrases", "Tip has changed"),
    Code.CHANGE_BEYOND_LIMIT: QT_TRANSLATE_NOOP("phrases", "Tip has changed"),
    Code.LAST_UNKNOWN: QT_TRANSLATE_NOOP("phrases", "No comparison possible"),
    Code.STEP: QT_TRANSLATE_NOOP("phrases", "Moved during the swing"),
    Code.TWO_STAGE_OFF: QT_TRANSLATE_NOOP("phrases", "Two-stage tip uncertain"),
    Code.NO_TIP: QT_TRANSLATE_NOOP("phrases", "No tip found"),
    Code.GOOD_UNCHECKED: QT_TRANSLATE_NOOP("phrases", "Within limits"),
    Code.CENTRES_REJECTED: QT_TRANSLATE_NOOP("phrases", "Many LED centres rejected"),
    Code.LED_REJECTED: QT_TRANSLATE_NOOP("phrases", "Many LED centres rejected"),
    Code.GOOD: QT_TRANSLATE_NOOP("phrases", "Within limits"),
}
# What to do at the screen; the core's own sentence stands in the braces.
_AT_THE_SCREEN: dict[Code, str] = {
    Code.PAUSED: QT_TRANSLATE_NOOP("phrases", "Press Space to continue."),
    Code.MANY_DROPPED: QT_TRANSLATE_NOOP("phrases", "{0} See the list in Review."),
}
_LACKS: dict[MissingInput, str] = {
    MissingInput.STATION: QT_TRANSLATE_NOOP(
        "phrases", "Enter the name of the station."
    ),
    MissingInput.OPERATOR: QT_TRANSLATE_NOOP(
        "phrases", "Enter the name of the operator."
    ),
    MissingInput.PEN: QT_TRANSLATE_NOOP(
        "phrases", "Enter the serial number of the pen."
    ),
    MissingInput.TIP: QT_TRANSLATE_NOOP("phrases", "Enter the name of the probe tip."),
    MissingInput.CONE: QT_TRANSLATE_NOOP("phrases", "Enter the name of the cone."),
    MissingInput.SOURCE: QT_TRANSLATE_NOOP("phrases", "Choose your camera."),
    MissingInput.SOURCE_PLACE: QT_TRANSLATE_NOOP(
        "phrases", "Choose the folder of the recorded images."
    ),
    MissingInput.DEVICE: QT_TRANSLATE_NOOP(
        "phrases", "Search for the camera and choose it."
    ),
    MissingInput.IMAGES: QT_TRANSLATE_NOOP(
        "phrases", "No image received from the camera yet."
    ),
    MissingInput.CAMERA_FILE: QT_TRANSLATE_NOOP("phrases", "Open the intrinsics file."),
    MissingInput.IMAGE_SIZE: QT_TRANSLATE_NOOP(
        "phrases",
        "The intrinsics file is for another image size. Open the file of this camera.",
    ),
    MissingInput.SECOND_DEVICE: QT_TRANSLATE_NOOP(
        "phrases", "Choose the second camera."
    ),
    MissingInput.SECOND_IMAGES: QT_TRANSLATE_NOOP(
        "phrases", "The second camera is not open. Open it."
    ),
    MissingInput.RIG_FILE: QT_TRANSLATE_NOOP(
        "phrases", "Open the rig file of both cameras."
    ),
    MissingInput.RIG_OF_TWO: QT_TRANSLATE_NOOP(
        "phrases", "The rig file does not describe two cameras. Open another file."
    ),
    MissingInput.SECOND_IMAGE_SIZE: QT_TRANSLATE_NOOP(
        "phrases",
        "The rig file is for another image size of the second camera. Open the file "
        "of these cameras.",
    ),
    MissingInput.PEN_FILE: QT_TRANSLATE_NOOP("phrases", "Open the LED geometry file."),
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
_ORIGINS: dict[Origin | None, str] = {
    Origin.LIVE: QT_TRANSLATE_NOOP("phrases", "LIVE CAMERA"),
    Origin.RECORDED: QT_TRANSLATE_NOOP("phrases", "RECORDED"),
    Origin.SIMULATED: QT_TRANSLATE_NOOP("phrases", "SIMULATED"),
    None: QT_TRANSLATE_NOOP("phrases", "ORIGIN NOT STATED"),
}
_GRADES: dict[Grade, str] = {
    Grade.PASS: QT_TRANSLATE_NOOP("phrases", "PASS"),
    Grade.SCALE: QT_TRANSLATE_NOOP("phrases", "SCALE OK"),
    Grade.STEADY: QT_TRANSLATE_NOOP("phrases", "STEADY"),
    Grade.CHECK: QT_TRANSLATE_NOOP("phrases", "CHECK"),
    Grade.REPEAT: QT_TRANSLATE_NOOP("phrases", "REPEAT"),
}
# Of contributions to U: in a word or two, and whole.
_SHARES: dict[ContributionName, tuple[str, str]] = {
    ContributionName.NOISE: (
        QT_TRANSLATE_NOOP("phrases", "noise"),
        QT_TRANSLATE_NOOP("phrases", "Image noise"),
    ),
    ContributionName.FORM: (
        QT_TRANSLATE_NOOP("phrases", "form of ball, cone"),
        QT_TRANSLATE_NOOP("phrases", "Form error of ball and cone"),
    ),
    ContributionName.SEAT: (
        QT_TRANSLATE_NOOP("phrases", "seating"),
        QT_TRANSLATE_NOOP("phrases", "Seating of the tip in the cone"),
    ),
    ContributionName.DRIFT: (
        QT_TRANSLATE_NOOP("phrases", "drift"),
        QT_TRANSLATE_NOOP("phrases", "Drift of cone and camera"),
    ),
    ContributionName.LEDS: (
        QT_TRANSLATE_NOOP("phrases", "LEDs"),
        QT_TRANSLATE_NOOP("phrases", "LED positions of the LED file"),
    ),
    ContributionName.DIAMETER: (
        QT_TRANSLATE_NOOP("phrases", "disc diameter"),
        QT_TRANSLATE_NOOP("phrases", "Diameter of the LED discs"),
    ),
    ContributionName.CAMERA: (
        QT_TRANSLATE_NOOP("phrases", "camera"),
        QT_TRANSLATE_NOOP("phrases", "Intrinsics of the camera"),
    ),
    ContributionName.EXTRINSICS: (
        QT_TRANSLATE_NOOP("phrases", "rig"),
        QT_TRANSLATE_NOOP("phrases", "Extrinsics of the cameras"),
    ),
    ContributionName.METHOD: (
        QT_TRANSLATE_NOOP("phrases", "two-stage method"),
        QT_TRANSLATE_NOOP("phrases", "Two-stage method, difference from the joint fit"),
    ),
    ContributionName.LENS: (
        QT_TRANSLATE_NOOP("phrases", "lens"),
        QT_TRANSLATE_NOOP("phrases", "Lens and LED centres"),
    ),
}
# What to do for a posture in each direction; as `_SIDES`.
_LEANS = (
    QT_TRANSLATE_NOOP("phrases", "Tilt right"),
    QT_TRANSLATE_NOOP("phrases", "Away and right"),
    QT_TRANSLATE_NOOP("phrases", "Tilt away"),
    QT_TRANSLATE_NOOP("phrases", "Away and left"),
    QT_TRANSLATE_NOOP("phrases", "Tilt left"),
    QT_TRANSLATE_NOOP("phrases", "Towards you and left"),
    QT_TRANSLATE_NOOP("phrases", "Tilt towards you"),
    QT_TRANSLATE_NOOP("phrases", "Towards you and right"),
)
# How far, by the ring of the dial.
_TILTS = (
    QT_TRANSLATE_NOOP("phrases", "Keep the tip pressed into the cone."),
    QT_TRANSLATE_NOOP("phrases", "Slight tilt. Keep the tip pressed in."),
    QT_TRANSLATE_NOOP("phrases", "Large tilt. Keep the tip pressed in."),
)
# From the operator's right, against the clock seen from above.
_SIDES = (
    QT_TRANSLATE_NOOP("phrases", "to the right"),
    QT_TRANSLATE_NOOP("phrases", "away and right"),
    QT_TRANSLATE_NOOP("phrases", "away from you"),
    QT_TRANSLATE_NOOP("phrases", "away and left"),
    QT_TRANSLATE_NOOP("phrases", "to the left"),
    QT_TRANSLATE_NOOP("phrases", "towards you and left"),
    QT_TRANSLATE_NOOP("phrases", "towards you"),
    QT_TRANSLATE_NOOP("phrases", "towards you and right"),
)


def phrase(message: Message, heading: float | None = None) -> Instruction:
    """Return the words of a message of `lightpen.messages`.

    ``heading`` is the operator's right as the camera sees it, rad; without it sides are
    reported as the camera sees them.
    """
    code = Code(message.code)
    if code is Code.TOO_LITTLE_TILT and heading is not None:
        message = _by_own_sides(message, heading)
    short = _translated(_SHORTS[code]).format(**message.values)
    hint = worded(message)
    if code in _AT_THE_SCREEN:
        hint = _translated(_AT_THE_SCREEN[code]).format(hint)
    return Instruction(short, hint)


def lean_phrase(
    target: Posture, present: Posture | None, heading: float
) -> Instruction:
    """Return the words that lead to a posture from the present one, if that is seen.

    ``heading`` is the operator's right as the camera sees it, rad.
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
    return Instruction(short, _translated(hint))


def n_images_text(n_images: int) -> str:
    """Return a number of images, such as "12 images"."""
    if n_images == 1:
        return _translated(QT_TRANSLATE_NOOP("phrases", "1 image"))
    many = _translated(QT_TRANSLATE_NOOP("phrases", "{0} images"))
    return many.format(n_images)


def missing_input_text(lack: MissingInput) -> str:
    """Return the advice on a missing input."""
    return _translated(_LACKS[lack])


def first_missing(missing_inputs: Sequence[MissingInput]) -> str:
    """Return the first missing input as a sentence; empty if complete."""
    return missing_input_text(missing_inputs[0]) if missing_inputs else ""


def reason_text(reason: Reason) -> str:
    """Return why an image does not take part, a few words; empty for one that does."""
    return worded(reason.words) if reason else ""


def share_text(name: ContributionName, *, is_whole: bool = False) -> str:
    """Return a contribution to U in a word or two, as in plots, or as a whole."""
    return _translated(_SHARES[name][is_whole])


def phase_text(phase: Phase, pause: Pause = Pause.NONE) -> str:
    """Return the name of a swing's phase; a pause has its own."""
    return _translated(_PAUSES.get(pause, _PHASES[phase]))


def grade_text(grade: Grade) -> str:
    """Return the word of a verdict."""
    return _translated(_GRADES[grade])


def age_text(days: int) -> str:
    """Return an age in days, such as "Yesterday"."""
    if days == 0:
        return _translated(QT_TRANSLATE_NOOP("phrases", "Today"))
    if days == 1:
        return _translated(QT_TRANSLATE_NOOP("phrases", "Yesterday"))
    return _translated(QT_TRANSLATE_NOOP("phrases", "{0} days ago")).format(days)


def origin_text(origin: Origin | None) -> str:
    """Return the name of an origin; None if unknown."""
    return _translated(_ORIGINS[origin])


def accepted_phrase(origin: Origin | None) -> Instruction:
    """Return the text on an accepted tip."""
    if origin is not Origin.SIMULATED:
        return Instruction(_translated(QT_TRANSLATE_NOOP("phrases", "ACCEPTED")))
    return Instruction(
        _translated(QT_TRANSLATE_NOOP("phrases", "PRACTICE SAVED")),
        _translated(
            QT_TRANSLATE_NOOP("phrases", "Simulated result; not used for any pen.")
        ),
    )


def _by_own_sides(message: Message, heading: float) -> Message:
    """Convert directions from the camera's view to the operator's."""
    sides = message.values["sides"]
    if sides == MOST_SIDES:
        return message
    assert isinstance(sides, tuple)
    turned = round(heading / (2 * math.pi / N_DIRECTIONS))
    own = sorted((SIDES.index(side) - turned) % N_DIRECTIONS for side in sides)
    words = listed(_translated(_SIDES[side]) for side in own)
    return replace(message, values={**message.values, "sides": words})


def _translated(text: str) -> str:
    return QCoreApplication.translate(CONTEXT, text) if text else ""


GRADE_MARKS: dict[Grade, tuple[Sign, Tone]] = {
    Grade.PASS: (Sign.CHECK, Tone.GOOD),
    Grade.SCALE: (Sign.CHECK, Tone.ACTIVE),
    Grade.STEADY: (Sign.CHECK, Tone.ACTIVE),
    Grade.CHECK: (Sign.WARNING, Tone.WARN),
    Grade.REPEAT: (Sign.CROSS, Tone.BAD),
}
DECISION_MARKS: dict[Decision | None, tuple[Sign, Tone]] = {
    Decision.ACCEPTED: (Sign.CHECK, Tone.GOOD),
    Decision.OPEN: (Sign.WARNING, Tone.WARN),
    Decision.REJECTED: (Sign.CROSS, Tone.BAD),
    None: (Sign.CHECK, Tone.PLAIN),
}
