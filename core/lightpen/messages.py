"""What the operator is told while the pen swings, and of the tip that came of it."""

from collections.abc import Iterable
from enum import StrEnum, unique

from lightpen.sentences import Sentence, sentence

MANY_SIDES = 4  # of eight; more are not told one by one


@unique
class Code(StrEnum):
    """Names each message, for the words and signs that a screen adds to it."""

    SHOW_PEN = "swing.show-pen"
    SEAT_TIP = "swing.seat-tip"
    SWING_TO_SEAT = "swing.swing-to-seat"
    HOLD_STILL = "swing.hold-still"
    STARTS_IN = "swing.starts-in"
    LEAN_TO_YOUR_RIGHT = "swing.lean-to-your-right"
    FOLLOW_ARROW = "swing.follow-arrow"
    FEW_LEDS = "swing.few-leds"
    TOO_FAST = "swing.too-fast"
    BAD_FIT = "swing.bad-fit"
    TIP_SLIPPED = "swing.tip-slipped"
    PEN_LOST = "swing.pen-lost"
    PEN_LIFTED = "swing.pen-lifted"
    TIP_ELSEWHERE = "swing.tip-elsewhere"
    IMAGES_READ = "swing.images-read"
    PAUSED = "swing.paused"
    SOLVING = "swing.solving"
    TOO_FEW_IMAGES = "verdict.too-few-images"
    TOO_LITTLE_TILT = "verdict.too-little-tilt"
    NOT_UPRIGHT = "verdict.not-upright"
    UNKNOWN = "verdict.unknown"
    UNCERTAIN = "verdict.uncertain"
    HALVES_DIFFER = "verdict.halves-differ"
    MANY_DROPPED = "verdict.many-dropped"
    LEDS_OFF = "verdict.leds-off"
    LED_DISPLACED = "verdict.led-displaced"
    LEDS_MISFIT = "verdict.leds-misfit"
    FILE_UNCERTAIN = "verdict.file-uncertain"
    FILE_ASSUMED = "verdict.file-assumed"
    FILE_CONTRADICTED = "verdict.file-contradicted"
    NOT_SIMULTANEOUS = "verdict.not-simultaneous"
    CAMERA_MOVED = "verdict.camera-moved"
    OUT_OF_REACH = "swing.out-of-reach"
    TIP_CHANGED = "verdict.tip-changed"
    CHANGE_BEYOND_LIMIT = "verdict.change-beyond-limit"
    LAST_UNKNOWN = "verdict.last-unknown"
    NO_TIP = "verdict.no-tip"
    GOOD = "verdict.good"


SHOW_PEN = sentence(Code.SHOW_PEN, "Hold it so that the camera sees its LEDs.")
SEAT_TIP = sentence(Code.SEAT_TIP, "Press the tip into the cone and keep it there.")
SWING_TO_SEAT = sentence(  # no nominal tip: it is found by swinging
    Code.SWING_TO_SEAT, "Press the tip into the cone and swing the pen gently."
)
HOLD_STILL = sentence(Code.HOLD_STILL, "The tip rests in the cone. Keep it pressed in.")
LEAN_TO_YOUR_RIGHT = sentence(
    Code.LEAN_TO_YOUR_RIGHT, "To YOUR right: it tells the program where you stand."
)
FOLLOW_ARROW = sentence(Code.FOLLOW_ARROW, "Keep the tip pressed into the cone.")
TOO_FAST = sentence(Code.TOO_FAST, "The LEDs are smeared. Swing the pen slowly.")
PEN_LOST = sentence(
    Code.PEN_LOST, "Turn its LEDs to the camera; nothing is lost meanwhile."
)
PEN_LIFTED = sentence(Code.PEN_LIFTED, "The pen is lifted. Put the tip back to go on.")
PAUSED = sentence(Code.PAUSED, "The swing is paused.")
SOLVING = sentence(Code.SOLVING, "The tip is being computed. Keep the pen at hand.")
UNKNOWN = sentence(
    Code.UNKNOWN,
    "The images do not tell yet where the tip is. Lean the pen to all sides.",
)

# By the directions of the dial, as the camera sees them: against the clock from above.
SIDES = (
    sentence("side.right", "to the right"),
    sentence("side.away-right", "away to the right"),
    sentence("side.away", "away from the camera"),
    sentence("side.away-left", "away to the left"),
    sentence("side.left", "to the left"),
    sentence("side.towards-left", "towards the camera to the left"),
    sentence("side.towards", "towards the camera"),
    sentence("side.towards-right", "towards the camera to the right"),
)
MOST_SIDES = sentence("side.most", "to most sides")


def starts_in(seconds: int) -> Sentence:
    """Tell when images begin to be kept."""
    return sentence(
        Code.STARTS_IN, "Keep the tip pressed into the cone.", seconds=seconds
    )


def few_leds(seen: int, needed: int) -> Sentence:
    """Tell that an image shows too few LEDs."""
    return sentence(
        Code.FEW_LEDS,
        "LEDs seen: {seen}, needed: {needed}. A finger may cover them; or lean back a "
        "little.",
        seen=seen,
        needed=needed,
    )


def bad_fit(noise: float, usual: float) -> Sentence:
    """Tell that the LEDs of an image do not fit: its noise and that of others, px."""
    return sentence(
        Code.BAD_FIT,
        "{noise:.3f} px in this image, {usual:.3f} px in the others. A finger or a "
        "reflection may cover part of an LED.",
        noise=noise,
        usual=usual,
    )


def tip_slipped(n_dropped: int) -> Sentence:
    """Tell that the tip has left its place, and how many images that costs."""
    return sentence(
        Code.TIP_SLIPPED,
        "Images dropped: {n_dropped}. Press the tip into the cone again.",
        n_dropped=n_dropped,
    )


def tip_elsewhere(distance: float) -> Sentence:
    """Tell that the tip rests in another place, and how far away, mm."""
    return sentence(
        Code.TIP_ELSEWHERE,
        "It rests {distance:.2f} mm from where it was. Put it back into the cone; "
        "check that the cone is clamped.",
        distance=distance,
    )


def images_read(n_read: int, n_images: int) -> Sentence:
    """Tell how many images of a recording are read."""
    return sentence(
        Code.IMAGES_READ,
        "All recorded images are read, then the tip is computed.",
        n_read=n_read,
        n_images=n_images,
    )


def too_few_images(n_kept: int, needed: int) -> Sentence:
    """Tell that fewer images are kept than the limits ask for."""
    return sentence(
        Code.TOO_FEW_IMAGES,
        "Images kept: {n_kept} of at least {needed}.",
        n_kept=n_kept,
        needed=needed,
    )


def too_little_tilt(n_images: int, directions: Iterable[int]) -> Sentence:
    """Tell how many images are missing, in which directions of the dial (0 to 7)."""
    sides = tuple(SIDES[direction] for direction in sorted(set(directions)))
    return sentence(
        Code.TOO_LITTLE_TILT,
        "Too little tilt {sides}. Lean the pen further that way. Images still needed: "
        "about {n_images}.",
        sides=sides if len(sides) <= MANY_SIDES else MOST_SIDES,
        n_images=n_images,
    )


def not_upright(n_images: int) -> Sentence:
    """Tell how many images of the upright pen are missing."""
    return sentence(
        Code.NOT_UPRIGHT,
        "Images of the upright pen still needed: {n_images}.",
        n_images=n_images,
    )


def uncertain(uncertainty: float, limit: float) -> Sentence:
    """Tell that U (k = 2) of the tip is above its limit, mm."""
    return sentence(
        Code.UNCERTAIN,
        "U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. "
        "Capture more images in postures that differ.",
        uncertainty=uncertainty,
        limit=limit,
    )


def cannot_get_below(floor: float, limit: float) -> Sentence:
    """Tell that U (k = 2) stays above its limit whatever is captured, mm."""
    return sentence(
        Code.OUT_OF_REACH,
        "U (k = 2) cannot get below {floor:.1f} \N{MICRO SIGN}m with this LED file; "
        "the limit is {limit:.1f} \N{MICRO SIGN}m. No more images are asked for than "
        "the postures need.",
        floor=1000 * floor,
        limit=1000 * limit,
    )


def file_uncertain(
    uncertainty: float, limit: float, share: float, advice: Sentence, assumed: bool
) -> Sentence:
    """Tell that U (k = 2) of the tip is above its limit by what a file says, mm.

    Parameters
    ----------
    share : float
        U (k = 2) by that alone, mm.
    advice : Sentence
        What it is and what to do, to be put after "from".
    assumed : bool
        Whether the file leaves its uncertainty out.
    """
    if assumed:
        return sentence(
            Code.FILE_ASSUMED,
            "U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. "
            "{share:.4f} mm of it is assumed, for {advice}. More images hardly help.",
            uncertainty=uncertainty,
            limit=limit,
            share=share,
            advice=advice,
        )
    return sentence(
        Code.FILE_UNCERTAIN,
        "U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. "
        "{share:.4f} mm of it comes from {advice}. More images hardly help.",
        uncertainty=uncertainty,
        limit=limit,
        share=share,
        advice=advice,
    )


def file_contradicted(why: Sentence) -> Sentence:
    """Tell what the images say against a file."""
    return sentence(Code.FILE_CONTRADICTED, "{why}", why=why)


def not_simultaneous(camera: str, lag: float) -> Sentence:
    """Tell by which part of the time between two images a camera is late."""
    return sentence(
        Code.NOT_SIMULTANEOUS,
        "Camera {camera} is out of step with the first camera by some {lag:.2f} of the "
        "time between two images. That moves the tip, and other warnings may come of "
        "it. Trigger all cameras by one signal, or hold the pen still for each image.",
        camera=camera,
        lag=abs(lag),
    )


def camera_moved(distance: float) -> Sentence:
    """Tell how far cone and camera moved against each other during the swing, mm."""
    return sentence(
        Code.CAMERA_MOVED,
        "Cone and camera moved by {distance:.3f} mm against each other during the "
        "swing. It is taken out as far as the images tell, but touches would not be "
        "right either. Clamp both, and let the camera warm up.",
        distance=distance,
    )


def tip_changed(
    distance: float, date: str, axis: str, difference: float, uncertainty: float
) -> Sentence:
    """Tell that a tip is not where it was, beyond what U explains.

    Parameters
    ----------
    distance : float
        How far it is from there, mm.
    date : str
        Of the earlier result.
    axis : str
        Of the pen's frame, along which it is least explained.
    difference, uncertainty : float
        Along it, with U (k = 2) by both results, mm.
    """
    return sentence(
        Code.TIP_CHANGED,
        "The tip lies {distance:.4f} mm from that of {date}: along {axis} "
        "{difference:.4f} mm, where U (k = 2) of both explains {uncertainty:.4f} mm. "
        "Was it exchanged, bent, or mounted anew?",
        distance=distance,
        date=date,
        axis=axis,
        difference=difference,
        uncertainty=uncertainty,
    )


def change_beyond_limit(distance: float, date: str, limit: float) -> Sentence:
    """Tell that a tip is further from where it was than its limit allows.

    Parameters
    ----------
    distance : float
        How far it is from there, mm.
    date : str
        Of the earlier result.
    limit : float
        Of the tip, mm.
    """
    return sentence(
        Code.CHANGE_BEYOND_LIMIT,
        "The tip lies {distance:.4f} mm from that of {date}; its limit is "
        "{limit:.4f} mm. Was it exchanged, bent, or mounted anew?",
        distance=distance,
        date=date,
        limit=limit,
    )


def last_unknown(why: Sentence) -> Sentence:
    """Tell that a tip cannot be compared with the one in force."""
    return sentence(
        Code.LAST_UNKNOWN,
        "The tip cannot be compared with the one in force. {why}",
        why=why,
    )


def halves_differ(difference: float, usual: float) -> Sentence:
    """Tell how far apart odd and even images put the tip, and U (k = 2) of it, mm."""
    return sentence(
        Code.HALVES_DIFFER,
        "Odd and even images put the tip {difference:.4f} mm apart, {usual:.4f} mm is "
        "usual. The tip may have moved: repeat the swing with the tip pressed in.",
        difference=difference,
        usual=usual,
    )


def many_dropped(n_dropped: int, n_images: int) -> Sentence:
    """Tell how many of the images that show the pen do not take part."""
    return sentence(
        Code.MANY_DROPPED,
        "{n_dropped} of {n_images} images do not take part. Repeat the swing if the "
        "tip slipped.",
        n_dropped=n_dropped,
        n_images=n_images,
    )


def leds_off(sigma: float, uncertainty: float) -> Sentence:
    """Tell the error of the LED file, and U (k = 2) of the tip by it alone, mm."""
    return sentence(
        Code.LEDS_OFF,
        "The LED file is off by {sigma:.3f} mm a coordinate, which alone makes U "
        "(k = 2) {uncertainty:.4f} mm. Is this the LED file of this pen? More images "
        "hardly help.",
        sigma=sigma,
        uncertainty=uncertainty,
    )


def led_displaced(led: int, distance: float) -> Sentence:
    """Tell which LED is not where the LED file has it, and how far off it is, mm."""
    return sentence(
        Code.LED_DISPLACED,
        "LED {led} sits {distance:.2f} mm off its place in the LED file. Is this the "
        "LED file of this pen?",
        led=led,
        distance=distance,
    )


def leds_misfit(sigma: float, usual: float) -> Sentence:
    """Tell the residuals of a fit, and what they are at most as a rule, px."""
    return sentence(
        Code.LEDS_MISFIT,
        "The residuals are {sigma:.2f} px, {usual:.2f} px or less is usual. Is this "
        "the LED file of this pen, and the intrinsics file of this camera and lens?",
        sigma=sigma,
        usual=usual,
    )


def no_tip(why: Sentence) -> Sentence:
    """Tell why there is no tip."""
    return sentence(Code.NO_TIP, "{why}", why=why)


def tip_is_good(uncertainty: float) -> Sentence:
    """Tell U (k = 2) of a tip with which all is well, mm."""
    return sentence(
        Code.GOOD,
        "U (k = 2) of the tip is {uncertainty:.4f} mm.",
        uncertainty=uncertainty,
    )
