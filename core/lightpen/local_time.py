"""Times in the time zone of the machine."""

from datetime import UTC, datetime


def local_now() -> datetime:
    """Return the present time; see `local_time`."""
    return local_time(datetime.now(UTC))


def local_time(moment: datetime) -> datetime:
    """Return a time in the time zone of the machine.

    It is in UTC where ``TZ`` names a zone that is a day or more away, which Python
    refuses to count with.
    """
    try:
        return moment.astimezone()
    except ValueError:
        return moment.astimezone(UTC)
