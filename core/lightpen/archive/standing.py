"""How the tips of a station stand, by what its archive tells."""

from datetime import datetime

from lightpen.archive.database import Database
from lightpen.archive.due import due_tips
from lightpen.model.due_rule import DueRule
from lightpen.record.standing import InForce, Standings
from lightpen.record.tip_library import Library


def standings(
    database: Database, chain: str, rule: DueRule, library: Library, now: datetime
) -> Standings:
    """Return how all tips of a station stand now.

    Parameters
    ----------
    chain : str
        That is at home at the station.
    rule : DueRule
        For tips that have none of their own.
    """
    in_force = {}
    for tip in due_tips(database, chain, rule, library):
        event = tip.entry.entry.event
        pair = event.names.pen, event.names.tip
        in_force[pair] = InForce(tip.calibrated, tip.due, tip.is_due(now))
    return Standings(library, in_force, now)
