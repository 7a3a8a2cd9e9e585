"""Which tips of a pen are due after one was calibrated."""

from contextlib import suppress

from lightpen.errors import FileError
from lightpen.record.archive import Archive
from lightpen.record.results import Result

MOST = 4  # tips that a pen has in use, as a rule


def next_tips(archive: Archive, present: Result) -> tuple[Result, ...]:
    """Return the results in force of the other tips of a pen, the oldest first.

    Results that cannot be read are passed over.
    """
    pen, is_simulated = present.names.pen, present.is_simulated
    found: list[Result] = []
    with suppress(FileError):
        tips = archive.tips(pen, is_simulated=is_simulated)
        for tip in [tip for tip in tips if tip != present.names.tip][:MOST]:
            with suppress(FileError):
                result = archive.in_force(pen, tip, is_simulated=is_simulated)
                found += [] if result is None else [result]
    return tuple(reversed(found))
