"""(being written elsewhere)"""

from datetime import datetime
from pathlib import Path

from lightpen.estimation.verdict import Verdict
from lightpen.record.names import Names
from lightpen.record.reading import open_record
from lightpen.record.results import Result, store_result
from lightpen.record.solving import Solution
from lightpen.record.writing import RecordWriter


def accept(
    archive: Path, solution: Solution, verdict: Verdict, names: Names, now: datetime
) -> Result:
    """Put a tip in force."""
    calibration = solution.calibration
    folder = solution.source.camera_file.parent
    result = Result(
        names=names,
        accepted=now,
        grade=verdict.grade,
        tip_pen=calibration.joint.tip_pen,
        uncertainty=calibration.budget.expanded_uncertainty[:3],
        record=str(folder),
    )
    with RecordWriter.resume(open_record(folder)) as writer:
        store_result(archive, result)
        writer.conclude(verdict.grade)
    return result
