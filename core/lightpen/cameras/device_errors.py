"""Errors of real cameras, common to all libraries."""

from collections.abc import Iterator
from contextlib import contextmanager

from lightpen.cameras.protocol import (
    ConfigError,
    DeviceBusy,
    DeviceLost,
    DeviceNotFound,
)


def not_found(place: str, why: str = "") -> DeviceNotFound:
    """Return the error of a camera that was not found."""
    return DeviceNotFound("camera.not-found", place=place, why=why and f" ({why})")


def busy(place: str) -> DeviceBusy:
    """Return the error of a camera in use by another program."""
    return DeviceBusy("camera.busy", place=place)


def lost(serial: str, why: str) -> DeviceLost:
    """Return the error of a camera that no longer responds."""
    return DeviceLost("camera.lost", serial=serial, why=why)


def setting_refused(serial: str, why: str) -> ConfigError:
    """Return the error of a refused setting."""
    return ConfigError("camera.refused", serial=serial, why=why)


@contextmanager
def in_sentences(
    serial: str,
    refusals: tuple[type[Exception], ...],
    losses: tuple[type[Exception], ...],
) -> Iterator[None]:
    """Convert exceptions of a library to refused settings and lost cameras."""
    try:
        yield
    except refusals as error:
        raise setting_refused(serial, str(error)) from error
    except losses as error:
        raise lost(serial, str(error)) from error
