"""Whether the intrinsics in a file may still be those of the camera in use."""

from datetime import date

from lightpen.model.camera import Camera
from lightpen.sentences import Sentence, sentence

OLDEST = 365  # days
# A lens of 25 mm on an aluminium mount: 0.01 % of focal length in 5 K, by which a file
# of 24 views of a board is off as well.
LARGEST_WARMTH = 5.0  # K


def doubts_about(
    camera: Camera,
    today: date,
    temperature_c: float | None = None,
    serial: str = "",
) -> tuple[Sentence, ...]:
    """Return why the intrinsics of a camera may not hold any more.

    Parameters
    ----------
    temperature_c : float, optional
        At the station, degrees Celsius.
    serial : str
        Of the camera in use, where it tells it.

    Returns
    -------
    tuple of Sentence
        Nothing is said of what the file or the station leaves out.
    """
    doubts = []
    if camera.serial and serial and camera.serial.casefold() != serial.casefold():
        doubts.append(
            sentence(
                "camera-validity.serial",
                "The camera file is of the camera {stated}, the camera in use is "
                "{used}. Give the file of this camera.",
                stated=camera.serial,
                used=serial,
            )
        )
    if camera.calibrated_on is not None:
        age = (today - camera.calibrated_on).days
        if age > OLDEST:
            doubts.append(
                sentence(
                    "camera-validity.age",
                    "The camera was calibrated {age} days ago, on {day}. Check it by "
                    "a swing, or calibrate it again.",
                    age=age,
                    day=camera.calibrated_on.isoformat(),
                )
            )
    if camera.temperature_c is not None and temperature_c is not None:
        warmth = temperature_c - camera.temperature_c
        if abs(warmth) > LARGEST_WARMTH:
            doubts.append(
                sentence(
                    "camera-validity.temperature",
                    "The camera was calibrated at {stated:.1f} degrees Celsius, the "
                    "station is at {used:.1f}. Check it by a swing, or calibrate it "
                    "again at this temperature.",
                    stated=camera.temperature_c,
                    used=temperature_c,
                )
            )
    return tuple(doubts)
