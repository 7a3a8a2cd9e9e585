"""The rule on paper is the one by which a verdict is given."""

import re

from lightpen.estimation.reports.calibration_record import VerdictLimits
from lightpen.estimation.reports.verdict import CHANGE_GATE, FAR_OFF, HALVES_GATE
from lightpen.record.calibrations import decision_rule


def test_the_rule_names_the_limits_of_the_record_and_the_gates_of_the_program() -> None:
    limits = VerdictLimits(max_uncertainty_mm=0.02, min_images=77, min_per_field=2)

    uncertainty, consistency, change, _ = map(str, decision_rule(limits))

    assert "0.0200 mm by simple acceptance" in uncertainty
    assert f"{FAR_OFF * 0.02:.4f} mm, {FAR_OFF:g} times" in uncertainty
    assert f"{HALVES_GATE:g} times U" in consistency
    assert "fewer than 77 images" in consistency
    assert f"{CHANGE_GATE:g} times U" in change
    assert not re.search(r"[{}]", uncertainty + consistency + change)
