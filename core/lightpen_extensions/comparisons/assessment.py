"""Assessment of a verification: grade, main reason and next step; its record."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Vector,
    has_checksum,
    parse_own_json,
    plain,
    record_bytes,
    record_heading,
)
from lightpen.local_time import local_now
from lightpen.messages import Message, message
from lightpen.model.coverage import (
    COVERAGE_FACTOR,
    Decision,
    DecisionRule,
    normal_quantile,
)
from lightpen.model.limits import VerificationLimits, rule_name
from lightpen.model.names import Origin
from lightpen.record.folder import VERIFICATIONS
from lightpen.record.library.entered_files import add_numbered
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.header import Names


def rule_in_words(limits: VerificationLimits) -> Message:
    """Return the decision rule of verifications."""
    rule = rule_name(limits.rule)
    if limits.rule is DecisionRule.RISK:
        return message("decision-rule.by-risk", rule=rule, risk=limits.risk)
    return message("decision-rule.by", rule=rule)


USE_TIP = message("verification.use-tip")
CALIBRATE_AGAIN = message("verification.calibrate-again")
VERIFY_AGAIN = message("verification.verify-again")
CHECK_FILES = message("verification.check-files")
BETTER_POSTURES = message("verification.better-postures")
MORE_POINTS = message("verification.more-points")


BY_SIMPLE_ACCEPTANCE = rule_in_words(VerificationLimits())
TITLE, COLUMN = 24, 10  # characters

BY_CHANCE = 0.01  # probability that no error looks significant: beyond 1.3 U
RELEVANT = 0.25  # of a limit: a smaller difference does not matter, however certain

WORST = (Grade.STEADY, Grade.SCALE, Grade.PASS, Grade.CHECK, Grade.REPEAT)  # last


@dataclass(frozen=True, eq=False)
class Scatter:
    """Coordinates (N, 3) of a point measured several times, mm."""

    points: FloatArray

    @property
    def mean(self) -> FloatArray:
        """Of each coordinate, (3,)."""
        return np.asarray(self.points.mean(axis=0))

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each coordinate, (3,)."""
        return np.asarray(self.points.std(axis=0, ddof=1))

    @property
    def range(self) -> FloatArray:
        """Largest minus smallest of each coordinate, (3,)."""
        return np.asarray(np.ptp(self.points, axis=0))

    @property
    def half_range(self) -> FloatArray:
        """Half the largest minus the smallest of each coordinate, (3,)."""
        return self.range / 2


@dataclass(frozen=True)
class VerificationAssessment:
    """Assessment of a verification.

    A value is compared with its limit by the decision rule of the limits. A difference
    that is more than chance and relevant for the limit is never accepted in silence.
    """

    grade: Grade
    reason: Message
    next_step: Message

    @property
    def is_accepted(self) -> bool:
        """Whether nothing was found against the tip."""
        return self.grade not in {Grade.CHECK, Grade.REPEAT}


def worst(found: Iterable[VerificationAssessment]) -> VerificationAssessment:
    """Return the worst assessment; of passing ones, one that verifies the tip."""
    return max(found, key=lambda each: WORST.index(each.grade))


def accepted(
    reason: Message, next_step: Message = USE_TIP, grade: Grade = Grade.PASS
) -> VerificationAssessment:
    """Return an assessment that passes, by default of the tip."""
    return VerificationAssessment(grade, reason, next_step)


def check(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment CHECK."""
    return VerificationAssessment(Grade.CHECK, reason, next_step)


def refused(reason: Message, next_step: Message) -> VerificationAssessment:
    """Return an assessment for an exceeded limit."""
    return VerificationAssessment(Grade.REPEAT, reason, next_step)


def graded(
    value: float,
    uncertainty: float,
    limit: float,
    limits: VerificationLimits,
    n_values: int = 1,
) -> Grade:
    """Return the grade of an error with its U (k = 2), mm, the worst of several.

    REPEAT if the decision rule rejects. CHECK if it does not decide, or if the error is
    significant and relevant for the limit.
    """
    decision = limits.decision(value, uncertainty, limit)
    if decision is Decision.REJECTED:
        return Grade.REPEAT
    is_significant = _is_significant(value, uncertainty, limit, n_values)
    return Grade.CHECK if is_significant or decision is Decision.OPEN else Grade.PASS


def _is_significant(
    value: float, uncertainty: float, limit: float, n_values: int
) -> bool:
    by_chance = normal_quantile(BY_CHANCE / (2 * n_values)) / COVERAGE_FACTOR
    return abs(value) > max(by_chance * uncertainty, RELEVANT * limit)


DRIFT = message("file.drift")


class _Drift(Struct):
    standard_uncertainty_share_mm: Vector


def read_drift(path: Path) -> FloatArray:
    """Return the standard uncertainty by a drift for points probed meanwhile."""
    data = read_bytes(path, DRIFT, LARGEST_RECORD)
    try:
        has_checksum(data)
        found = parse_own_json(data, _Drift)
    except DamagedError as error:
        raise FileError("verification.other-file", path=path, what=DRIFT) from error
    return np.array(found.standard_uncertainty_share_mm, dtype=np.float64)


def verification_record(
    kind: str,
    entries: Mapping[str, Any],
    assessment: VerificationAssessment | None,
    limits: Mapping[str, float],
    inputs: Mapping[str, Any],
    rule: Message = BY_SIMPLE_ACCEPTANCE,
) -> dict[str, Any]:
    """Return the record of a verification of a kind, of its entries and input files.

    The assessment is None of what is measured and not judged; the limits, mm, and the
    rule are those that it was judged by.
    """
    record = {
        **record_heading(local_now()),
        "verification": kind,
        "coverage_factor": COVERAGE_FACTOR,
        "verdict": None
        if assessment is None
        else {
            "grade": assessment.grade.value,
            **plain(assessment.reason),
            "next_step": assessment.next_step,
            "decision_rule": str(rule),
            "limits_mm": limits,
        },
        **entries,
        "inputs": inputs,
    }
    return {name: plain(entry) for name, entry in record.items()}


def verdict_lines(assessment: VerificationAssessment, rule: Message) -> list[str]:
    """Return the lines of a verdict."""
    return [
        f"Verdict      {assessment.grade.upper()}: {assessment.reason}",
        f"             {assessment.next_step}",
        f"             {rule}",
    ]


CONCLUSION = "conclusion"


def attributed(
    record: Mapping[str, Any],
    names: Names,
    origin: Origin | None,
    began: datetime | None = None,
) -> dict[str, Any]:
    """Return the record of a verification with who made it where, of what.

    The session began when the record was made, unless stated.
    """
    session = None if began is None else began.isoformat(timespec="seconds")
    return {
        **record,
        "session": session or record["created"],
        "station": names.station,
        "operator": names.operator,
        "pen": names.pen,
        "tip": names.tip,
        "origin": origin,
    }


def keep_verification(
    data: Path, record: Mapping[str, Any], *, is_simulated: bool
) -> Path:
    """Keep the record of a verification in a data folder, and return its file."""
    folder = verifications_folder(data, is_simulated=is_simulated)
    return add_numbered(data, folder, record_bytes(record))


def verifications_folder(data: Path, *, is_simulated: bool) -> Path:
    """Return the verifications folder of a data folder."""
    return (data / SIMULATED if is_simulated else data) / VERIFICATIONS


def conditions_entries(
    temperature_c: float | None, humidity_percent: float | None
) -> dict[str, float]:
    """Return the measured environment as entries of a record."""
    conditions = {"temperature_c": temperature_c, "humidity_percent": humidity_percent}
    return {name: each for name, each in conditions.items() if each is not None}
