"""A part as a task of a session: the simulated plate, undone points, what is kept."""

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from msgspec import structs
from tests.accepted_tip import Hold, Holder

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.files import FileFormat
from lightpen.messages import Message
from lightpen.model.rigid import FACING
from lightpen_extensions.measure.measuring.part import taught_plan
from lightpen_extensions.measure.measuring.plan import (
    Nominal,
    Plan,
    PlannedFeature,
    free_plan,
)
from lightpen_extensions.measure.measuring.qif import qif_text
from lightpen_extensions.measure.measuring.report import EXPORTS
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    advance_session,
    bands_so_far,
    end_task,
    without_last_touch,
)
from lightpen_extensions.measure.tasks.part import (
    PART,
    Part,
    planned_places,
    touches_of_part,
)
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.measure.tasks.task import Conditions, VerificationChoices
from lightpen_extensions.simulator.swings import PAPER_CONE

BALL = 10.0  # mm
QIF = Path(os.environ.get("LIGHTPEN_DATA", "no such folder")) / "qif/QIFDocument.xsd"
NOISE = 0.002  # mm
RAISED = FACING
UNMOVED = np.zeros(3)  # mm


@dataclass
class Station:
    """A session with a part, and a pen that a simulated hand holds."""

    setup: SessionSetup
    holder: Holder
    state: SessionState = field(default_factory=SessionState)

    def probe(
        self, n: int, plan: Plan | None = None, moved: FloatArray = UNMOVED
    ) -> None:
        """Probe the next points, of a plan with nominals or of the one in use."""
        by = self.setup.choices
        by = by if plan is None else replace(by, plan=plan)
        for _ in range(n):
            goal = PART.hand(by, len(self.state.runs), len(self.state.touches))
            assert goal.point is not None
            assert goal.outwards is not None
            place = goal.point + BALL / 2 * goal.outwards + moved
            seen = [*self.holder.still(Hold(tuple(place.tolist()), 0.1), 5)]
            for detection in [*seen, *self.holder.away(6)]:
                transition = advance_session(self.setup, self.state, "image", detection)
                self.state = transition.state

    @property
    def found(self) -> Part:
        found = self.state.found_by(PART)
        assert found is not None
        return found


def station(instrument: Instrument, plan: Plan) -> Station:
    choices = VerificationChoices(PART.kind, plan, n_frames=2)
    setup = SessionSetup(Conditions(instrument, ball_diameter=BALL), choices)
    return Station(setup, Holder(instrument.rig, instrument.pen))


def n_points(plan: Plan) -> int:
    return sum(each.n_touches for each in plan.features)


def probed_plate(
    instrument: Instrument, plan: Plan
) -> list[tuple[str, list[ProbedPoint]]]:
    """Return points of all features, which share the error of the tip."""
    rng = np.random.default_rng(5)
    choices, n_parameters = VerificationChoices(plan=plan), len(instrument.covariance)
    sensitivity = np.zeros((3, n_parameters))
    sensitivity[:, instrument.parameters.tip] = np.eye(3)
    runs = []
    for run, planned in enumerate(plan.features):
        points = []
        for step in range(planned.n_touches):
            goal = PART.hand(choices, run, step)
            assert goal.point is not None
            assert goal.outwards is not None
            center = PAPER_CONE + goal.point + BALL / 2 * goal.outwards
            points.append(
                ProbedPoint(
                    center + NOISE * rng.standard_normal(3),
                    NOISE**2 * np.eye(3),
                    sensitivity,
                    RAISED,
                    (f"{planned.name} {step}",),
                    rms=0.01,
                )
            )
        runs.append((planned.name, points))
    return runs


@pytest.fixture(scope="module")
def measured(instrument: Instrument) -> Station:
    """The plate of the simulated station, probed in one go."""
    at_it = station(instrument, plate_plan())
    runs = probed_plate(instrument, plate_plan())
    found = PART.measure(runs, at_it.setup.conditions, at_it.setup.choices)
    at_it.state = replace(at_it.state, done=PART, found=found)
    return at_it


def test_ten_features_of_the_plate_are_measured_without_a_key(
    measured: Station,
) -> None:
    part = measured.found.part

    assert len(part.plan.features) == 10
    for result in part.results:
        error = result.value.value - (result.planned.nominal or 0.0)
        assert abs(error) < max(2 * result.value.uncertainty, 0.02), result.planned
    assert measured.found.missing == ()
    assert measured.found.assessment.grade is not Grade.REPEAT


def test_tables_have_a_decision_for_each_characteristic(measured: Station) -> None:
    characteristics, features = PART.tables(measured.found, measured.setup.conditions)

    assert len(features.rows) == 10
    assert measured.found.part.alignment is not None
    assert isinstance(features.title, Message)
    assert features.title.code == "part.features-in-part"
    assert {str(row.remark) for row in characteristics.rows} <= {"OK", "NOT PROVEN"}
    entries = PART.entries(measured.found, measured.setup.instrument)
    assert len(entries["touches"]) == n_points(plate_plan())


@pytest.mark.parametrize("export", EXPORTS, ids=lambda each: each.name)
def test_every_export_names_the_characteristics(
    measured: Station, export: FileFormat
) -> None:
    part = measured.found.part
    text = export.encoded(part).decode()

    assert all(each.planned.label in text for each in part.results)


def test_qif_has_every_feature_with_its_place_and_uncertainty(
    measured: Station,
) -> None:
    part = measured.found.part
    names = {"q": "http://qifstandards.org/xsd/qif3"}
    root = ElementTree.fromstring(qif_text(part))
    (features,) = root.iterfind(".//q:MeasuredFeatures", names)

    assert [each.findtext("q:FeatureName", None, names) for each in features] == [
        *part.features
    ]
    (dome,) = features.iterfind("q:SphereFeatureMeasurement", names)
    place, diameter = (dome.find(f"q:{x}", names) for x in ("Location", "Diameter"))
    assert place is not None
    assert diameter is not None
    assert float(diameter.text or "") == pytest.approx(20, abs=0.02)
    assert float(place.attrib["xCombinedUncertainty"]) == pytest.approx(
        part.uncertainty("dome")[0] / 2
    )
    ids = [each.attrib["id"] for each in root.iter() if "id" in each.attrib]
    assert len(ids) == len(set(ids)) == int(root.attrib["idMax"])


@pytest.mark.skipif(not QIF.is_file(), reason="The schema of QIF is not there.")
def test_qif_is_as_its_published_schema_says(measured: Station) -> None:
    from xmlschema import XMLSchema  # takes long

    assert not [*XMLSchema(QIF).iter_errors(qif_text(measured.found.part))]


def test_a_taught_plan_measures_the_same_part_again(measured: Station) -> None:
    taught = taught_plan(measured.found.part)

    again = station(measured.setup.instrument, taught)
    again.probe(taught.features[0].n_touches)
    assert len(again.state.runs) == 1


def test_features_are_recognised_while_they_are_probed(instrument: Instrument) -> None:
    plate = plate_plan()
    at_it = station(instrument, free_plan("Part", touches=6))
    wanted = [plate.features[i] for i in (0, 7)]
    plate = structs.replace(
        plate, features=tuple(structs.replace(each, touches=6) for each in wanted)
    )
    at_it.probe(12, plate)
    at_it.state = end_task(at_it.setup, at_it.state).state

    kinds = [each.kind for each in at_it.found.part.features.values()]
    assert kinds == [FeatureKind.PLANE, FeatureKind.SPHERE]


def test_a_feature_that_is_done_shows_its_results_at_once(
    instrument: Instrument,
) -> None:
    plan = plate_plan().limited_to({"dome", "hole 1"})
    at_it = station(instrument, plan)
    own = plan.features[0].name
    at_it.probe(plan.features[0].n_touches)

    bands = bands_so_far(at_it.setup, at_it.state)

    planned = [each for each in plan.characteristics if each.of == (own,)]
    assert planned
    assert [each.name for each in bands] == [each.words for each in planned]
    assert [(each.lower, each.upper) for each in bands] == [
        each.limits for each in planned
    ]
    assert all(each.decision for each in bands)
    at_it.probe(1)  # of the next feature
    assert bands_so_far(at_it.setup, at_it.state) == bands


def test_a_line_is_planned_from_left_to_right_at_the_front_of_the_part() -> None:
    edge = Nominal(origin=(10.0, 0.0, 0.0), axis=(-1.0, 0.0, 0.0), length=40.0)
    front = PlannedFeature(
        "edge", FeatureKind.LINE, nominal=edge, normal=(0.0, -1.0, 0.0)
    )
    places = planned_places(front)

    along = [float(each.point[0]) for each in places]
    assert along == sorted(along)
    assert along[-1] - along[0] > 20
    for each in places:
        np.testing.assert_array_equal(each.normal, [0.0, -1.0, 0.0])


def test_an_undone_point_can_be_probed_again(instrument: Instrument) -> None:
    at_it = station(instrument, plate_plan())
    at_it.probe(3)
    at_it.state = without_last_touch(at_it.state)
    assert len(at_it.state.touches) == 2
    at_it.probe(4)

    assert len(at_it.state.runs) == 1


def test_a_plan_that_is_ended_early_gives_what_was_probed(
    instrument: Instrument,
) -> None:
    at_it = station(instrument, plate_plan())
    at_it.probe(6)
    at_it.state = end_task(at_it.setup, at_it.state).state

    assert [*at_it.found.part.features] == ["top"]
    assert len(at_it.found.missing) == 9
    assert at_it.found.assessment.grade is Grade.CHECK


def test_points_that_do_not_determine_their_feature_are_reported_at_once(
    instrument: Instrument,
) -> None:
    line = plate_plan().features[1]
    flat = structs.replace(line, touches=4)
    plan = structs.replace(
        plate_plan(),
        features=(structs.replace(flat, kind=FeatureKind.PLANE),),
        alignment=None,
        characteristics=(),
    )
    at_it = station(instrument, plan)
    at_it.probe(4, structs.replace(plan, features=(flat,)))

    assert not at_it.state.runs
    assert at_it.state.fault is not None
    assert str(at_it.state.fault).startswith(
        "Feature front: The points do not determine a plane."
    )
    assert len(at_it.state.touches) == 4  # nothing is lost


def test_nothing_is_measured_without_a_plan(instrument: Instrument) -> None:
    conditions = Conditions(instrument, ball_diameter=BALL)

    with pytest.raises(CalibrationError, match="No measuring plan"):
        PART.measure([], conditions, VerificationChoices())
    assert PART.missing(VerificationChoices(), BALL) is not None


def test_the_ball_is_known_by_its_diameter(instrument: Instrument) -> None:
    name, points = probed_plate(instrument, plate_plan())[0]
    conditions = Conditions(instrument, ball_diameter=10.0, ball_uncertainty=0.004)

    touches = touches_of_part([(name, each) for each in points], conditions)

    assert (touches.ball_radius, touches.ball_uncertainty) == (5.0, 0.002)


def test_a_camera_that_moved_counts_in_each_point(instrument: Instrument) -> None:
    name, points = probed_plate(instrument, plate_plan())[0]
    found, drift = [(name, each) for each in points], np.array([0.005, 0.002, 0.001])

    still, moved = (
        touches_of_part(found, conditions)
        for conditions in (Conditions(instrument), Conditions(instrument, drift=drift))
    )

    np.testing.assert_allclose(
        np.diag(moved.covariance - still.covariance).reshape(-1, 3),
        np.tile(drift**2, (len(points), 1)),
    )
