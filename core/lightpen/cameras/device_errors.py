"""What goes wrong with a real camera, in sentences that all libraries share."""

from collections.abc import Iterator
from contextlib import contextmanager

from lightpen.cameras.protocol import (
    ConfigError,
    DeviceBusy,
    DeviceLost,
    DeviceNotFound,
)
from lightpen.sentences import sentence


def not_found(place: str, why: str = "") -> DeviceNotFound:
    """Return the error of a camera that is not there."""
    return DeviceNotFound(
        sentence(
            "camera.not-found",
            "There is no camera {place}{why}. Check its power, its cable and its "
            "address, then search again.",
            place=place,
            why=why and f" ({why})",
        )
    )


def busy(place: str) -> DeviceBusy:
    """Return the error of a camera that another program has."""
    return DeviceBusy(
        sentence(
            "camera.busy",
            "Another program uses the camera {place}. Close that program, or wait a "
            "few seconds if it has just ended.",
            place=place,
        )
    )


def lost(serial: str, why: str) -> DeviceLost:
    """Return the error of a camera that no longer answers."""
    return DeviceLost(
        sentence(
            "camera.lost",
            "The camera {serial} no longer answers ({why}). Check its cable and its "
            "power.",
            serial=serial,
            why=why,
        )
    )


def setting_refused(serial: str, why: str) -> ConfigError:
    """Return the error of a setting that a camera does not take."""
    return ConfigError(
        sentence(
            "camera.refused",
            "The camera {serial} refuses a setting: {why}. Choose another.",
            serial=serial,
            why=why,
        )
    )


@contextmanager
def in_sentences(
    serial: str,
    refusals: tuple[type[Exception], ...],
    losses: tuple[type[Exception], ...],
) -> Iterator[None]:
    """Tell what a library raises: what a camera refuses, and that it is gone."""
    try:
        yield
    except refusals as error:
        raise setting_refused(serial, str(error)) from error
    except losses as error:
        raise lost(serial, str(error)) from error
