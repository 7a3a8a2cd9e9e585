"""Messages during a swing and about its result."""

from collections.abc import Iterable
from enum import StrEnum, unique

from lightpen.messages import Message, message

MANY_SIDES = 4  # of eight; more are not listed one by one


@unique
class Code(StrEnum):
    """Names each message, for the words and signs that a screen adds to it."""

    SHOW_PEN = "swing.show-pen"
    SEAT_TIP = "swing.seat-tip"
    SWING_TO_SEAT = "swing.swing-to-seat"
    HOLD_STILL = "swing.hold-still"
    STARTS_IN = "swing.starts-in"
    HOLD_UPRIGHT = "swing.hold-upright"
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
    MANY_EXCLUDED = "verdict.many-excluded"
    LEDS_OFF = "verdict.leds-off"
    LED_DISPLACED = "verdict.led-displaced"
    LEDS_MISFIT = "verdict.leds-misfit"
    FILE_UNCERTAIN = "verdict.file-uncertain"
    FILE_ASSUMED = "verdict.file-assumed"
    FILE_CONTRADICTED = "verdict.file-contradicted"
    NOT_SIMULTANEOUS = "verdict.not-simultaneous"
    CAMERA_MOVED = "verdict.camera-moved"
    NO_TEMPERATURE = "verdict.no-temperature"
    OUT_OF_REACH = "swing.out-of-reach"
    TIP_CHANGED = "verdict.tip-changed"
    CHANGE_BEYOND_LIMIT = "verdict.change-beyond-limit"
    LAST_UNKNOWN = "verdict.last-unknown"
    NO_TIP = "verdict.no-tip"
    GOOD = "verdict.good"


SHOW_PEN = message(Code.SHOW_PEN)
SEAT_TIP = message(Code.SEAT_TIP)
SWING_TO_SEAT = message(  # no nominal tip: it is found by swinging
    Code.SWING_TO_SEAT
)
HOLD_STILL = message(Code.HOLD_STILL)
HOLD_UPRIGHT = message(Code.HOLD_UPRIGHT)
LEAN_TO_YOUR_RIGHT = message(Code.LEAN_TO_YOUR_RIGHT)
FOLLOW_ARROW = message(Code.FOLLOW_ARROW)
TOO_FAST = message(Code.TOO_FAST)
PEN_LOST = message(Code.PEN_LOST)
PEN_LIFTED = message(Code.PEN_LIFTED)
PAUSED = message(Code.PAUSED)
SOLVING = message(Code.SOLVING)
NO_TEMPERATURE = message(Code.NO_TEMPERATURE)
UNKNOWN = message(Code.UNKNOWN)

# By the directions of the dial, as the camera sees them: against the clock from above.
SIDES = (
    message("side.right"),
    message("side.away-right"),
    message("side.away"),
    message("side.away-left"),
    message("side.left"),
    message("side.towards-left"),
    message("side.towards"),
    message("side.towards-right"),
)
MOST_SIDES = message("side.most")


def starts_in(seconds: int) -> Message:
    """Message: time until the capture begins."""
    return message(Code.STARTS_IN, seconds=seconds)


def few_leds(seen: int, needed: int) -> Message:
    """State that an image shows too few LEDs."""
    return message(Code.FEW_LEDS, seen=seen, needed=needed)


def bad_fit(noise: float, usual: float) -> Message:
    """State that the LEDs of an image do not fit: its noise and that of others, px."""
    return message(Code.BAD_FIT, noise=noise, usual=usual)


def tip_slipped(n_dropped: int) -> Message:
    """Message: the tip has slipped, with the number of images lost."""
    return message(Code.TIP_SLIPPED, n_dropped=n_dropped)


def tip_elsewhere(distance: float) -> Message:
    """Message: the tip rests in another place, with the distance, mm."""
    return message(Code.TIP_ELSEWHERE, distance=distance)


def images_read(n_read: int, n_images: int) -> Message:
    """Message: number of images read from a recording."""
    return message(Code.IMAGES_READ, n_read=n_read, n_images=n_images)


def too_few_images(n_kept: int, needed: int) -> Message:
    """Message: fewer images than the limit."""
    return message(Code.TOO_FEW_IMAGES, n_kept=n_kept, needed=needed)


def too_little_tilt(n_images: int, directions: Iterable[int]) -> Message:
    """Message: missing images by direction of the dial (0 to 7)."""
    sides = tuple(SIDES[direction] for direction in sorted(set(directions)))
    return message(
        Code.TOO_LITTLE_TILT,
        sides=sides if len(sides) <= MANY_SIDES else MOST_SIDES,
        n_images=n_images,
    )


def not_upright(n_images: int) -> Message:
    """Message: missing images of the upright pen."""
    return message(Code.NOT_UPRIGHT, n_images=n_images)


def uncertain(uncertainty: float, limit: float) -> Message:
    """State that U (k = 2) of the tip is above its limit, mm."""
    return message(Code.UNCERTAIN, uncertainty=uncertainty, limit=limit)


def cannot_get_below(floor: float, limit: float) -> Message:
    """State that U (k = 2) stays above its limit whatever is captured, mm."""
    return message(Code.OUT_OF_REACH, floor=1000 * floor, limit=1000 * limit)


def file_uncertain(
    uncertainty: float, limit: float, share: float, advice: Message, assumed: bool
) -> Message:
    """Message: a file's uncertainty raises U (k = 2) above its limit, mm.

    Parameters
    ----------
    share : float
        U (k = 2) by that alone, mm.
    advice : Message
        Cause and remedy, completing "from ...".
    assumed : bool
        Whether the file leaves its uncertainty out.
    """
    if assumed:
        return message(
            Code.FILE_ASSUMED,
            uncertainty=uncertainty,
            limit=limit,
            share=share,
            advice=advice,
        )
    return message(
        Code.FILE_UNCERTAIN,
        uncertainty=uncertainty,
        limit=limit,
        share=share,
        advice=advice,
    )


def file_contradicted(why: Message) -> Message:
    """Message: the images contradict a file."""
    return message(Code.FILE_CONTRADICTED, why=why)


def time_span(intervals: float, interval_ms: float | None) -> Message:
    """Return a time without its sign, given in image intervals: in µs to s if known."""
    if interval_ms is None:
        return message("time.intervals", value=abs(intervals))
    span_ms = abs(intervals) * interval_ms
    if span_ms < 0.9995:  # rounds to less than 1 ms
        return message("time.us", value=1000 * span_ms)
    if span_ms < 999.5:
        return message("time.ms", value=span_ms)
    return message("time.s", value=span_ms / 1000)


def lateness(intervals: float, interval_ms: float | None) -> Message:
    """Return how late something is, or early, given in image intervals."""
    time = time_span(intervals, interval_ms)
    if intervals < 0:
        return message("time.early", time=time)
    return message("time.late", time=time)


def not_simultaneous(camera: str, lag: Message) -> Message:
    """State how late a camera is, see `lateness`."""
    return message(Code.NOT_SIMULTANEOUS, camera=camera, lag=lag)


def camera_moved(distance: float) -> Message:
    """Message: motion between cone and camera during the swing, mm."""
    return message(Code.CAMERA_MOVED, distance=distance)


def tip_changed(
    distance: float, date: str, axis: str, difference: float, uncertainty: float
) -> Message:
    """Message: the tip has changed by more than the combined U.

    Parameters
    ----------
    distance : float
        How far it is from there, mm.
    date : str
        Date of the earlier result.
    axis : str
        Of the pen's frame, along which it is least explained.
    difference, uncertainty : float
        Along it, with U (k = 2) by both results, mm.
    """
    return message(
        Code.TIP_CHANGED,
        distance=distance,
        date=date,
        axis=axis,
        difference=difference,
        uncertainty=uncertainty,
    )


def change_beyond_limit(distance: float, date: str, limit: float) -> Message:
    """Message: the tip has changed by more than its limit.

    Parameters
    ----------
    distance : float
        How far it is from there, mm.
    date : str
        Date of the earlier result.
    limit : float
        Of the tip, mm.
    """
    return message(Code.CHANGE_BEYOND_LIMIT, distance=distance, date=date, limit=limit)


def last_unknown(why: Message) -> Message:
    """State that a tip cannot be compared with the one in force."""
    return message(Code.LAST_UNKNOWN, why=why)


def halves_differ(difference: float, usual: float) -> Message:
    """Message: difference between odd and even images, and its U (k = 2), mm."""
    return message(Code.HALVES_DIFFER, difference=difference, usual=usual)


def many_excluded(n_excluded: int) -> Message:
    """State how many images the user has excluded."""
    return message(Code.MANY_EXCLUDED, n_excluded=n_excluded)


def many_dropped(n_dropped: int, n_images: int) -> Message:
    """Message: number of excluded images that show the pen."""
    return message(Code.MANY_DROPPED, n_dropped=n_dropped, n_images=n_images)


def leds_off(sigma: float, uncertainty: float) -> Message:
    """State the error of the LED file, and U (k = 2) of the tip by it alone, mm."""
    return message(Code.LEDS_OFF, sigma=sigma, uncertainty=uncertainty)


def led_displaced(led: int, distance: float) -> Message:
    """Message: an LED is not at its file position, with the distance, mm."""
    return message(Code.LED_DISPLACED, led=led, distance=distance)


def leds_misfit(sigma: float, usual: float) -> Message:
    """State the residuals of a fit, and what they are at most as a rule, px."""
    return message(Code.LEDS_MISFIT, sigma=sigma, usual=usual)


def no_tip(why: Message) -> Message:
    """State why there is no tip."""
    return message(Code.NO_TIP, why=why)


def tip_is_good(uncertainty: float) -> Message:
    """State U (k = 2) of a tip with which all is well, mm."""
    return message(Code.GOOD, uncertainty=uncertainty)
