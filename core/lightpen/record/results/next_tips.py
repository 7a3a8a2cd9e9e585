"""Tips of a pen that can be calibrated next."""

from contextlib import suppress
from dataclasses import dataclass

from lightpen.errors import FileError
from lightpen.record.library.tip_library import Library, ListedTip
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result

MOST = 4  # tips that a pen has in use, as a rule


@dataclass(frozen=True, eq=False)
class NextTip:
    """A tip to be calibrated next: its last result with the pen, its entry, if any."""

    pen: str
    tip: str
    last: Result | None
    listed: ListedTip | None


def next_tips(archive: FolderArchive, present: Result) -> tuple[NextTip, ...]:
    """Return the other tips of a pen: current ones, the oldest first, then others.

    Those of the library that were never calibrated with the pen follow, unless it is a
    simulated one. Retired tips are left out; results that cannot be read are passed
    over.
    """
    pen, is_simulated = present.names.pen, present.is_simulated
    library, found = Library(), list[NextTip]()
    with suppress(FileError):
        library = archive.library()
    with suppress(FileError):
        known = archive.tips(pen, is_simulated=is_simulated)
        tips = [tip for tip in known if tip != present.names.tip]
        for tip in [tip for tip in tips if not library.has_retired(tip)][:MOST]:
            with suppress(FileError):
                last = archive.in_force(pen, tip, is_simulated=is_simulated)
                if last is not None:
                    found.append(NextTip(pen, tip, last, library.tip(tip)))
        if not is_simulated:
            new = [tip for tip in library.tips if tip not in known]
            found = [
                *(NextTip(pen, tip, None, library.tips[tip]) for tip in reversed(new)),
                *found,
            ]
    others = [each for each in found if each.tip != present.names.tip]
    in_use = [each for each in others if not library.has_retired(each.tip)]
    return tuple(reversed(in_use))[:MOST]
