"""A repeatability study of archived tips, kept as the command line keeps one."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from lightpen.archive.chains.entries import StoredEntry
from lightpen.comparisons.records import repeatability_entries, verification_record
from lightpen.comparisons.repeatability import Repeatability
from lightpen.formats.hashes import InputFile
from lightpen.formats.json_records import file_entry
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen.model.origin import Origin
from lightpen.record.folder.verifications import attributed, keep_verification


def keep_study(
    data: Path,
    found: Repeatability,
    entries: Sequence[StoredEntry],
    limits: VerificationLimits,
    operator: str,
) -> Path:
    """Keep a study of tips as a verification of a data folder, and return its file."""
    events = [each.entry.event for each in entries]
    results = [each.result for each in events if each.result is not None]
    record = verification_record(
        "repeatability",
        repeatability_entries(found),
        found.assessment,
        {"repeatability": limits.repeatability},
        {"files": [file_entry(InputFile(Path(r.place), r.sha256)) for r in results]},
        rule_in_words(limits),
    )
    is_simulated = any(each.is_simulated for each in events)
    origin = Origin.SIMULATED if is_simulated else events[-1].origin
    names = replace(events[-1].names, operator=operator)
    record = attributed(record, names, origin)
    return keep_verification(data, record, is_simulated=is_simulated)
