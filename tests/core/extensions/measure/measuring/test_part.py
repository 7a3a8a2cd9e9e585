"""A part measured by a plan: features, frame, characteristics, each with its U."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, FileError
from lightpen.model.artefacts import Side
from lightpen.model.coverage import Decision
from lightpen.model.limits import VerificationLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.next_touch import PartTouches
from lightpen_extensions.measure.measuring.part import MeasuredPart, measure_part
from lightpen_extensions.measure.measuring.plan import (
    QUANTITIES,
    SIMULATED_PLATE,
    CharacteristicKind,
    Plan,
)
from lightpen_extensions.measure.measuring.plan_checks import missing_normal, parse_plan
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_extensions.measure.probing_operator import plate_plan

R = rotation_from_vector(np.array([0.4, -0.7, 0.2]))
T = np.array([120.0, -80.0, 1400.0])
BALL = 3.0  # mm, radius
NOISE, COMMON = 0.004, 0.02  # mm
TURN = np.deg2rad(np.arange(0, 360, 45))
UP = np.array([0.0, 0.0, 1.0])

PLAN = """
name: Plate
rule: guard band
features:
  - {name: top, kind: plane, touches: 6}
  - {name: front, kind: line, normal: [0, -1, 0]}
  - {name: hole, kind: circle, side: inside, nominal: {origin: [0, 0, 0]}}
  - {name: bore, kind: cylinder, side: inside, nominal: {origin: [60, 0, 0]}}
  - {name: dome, kind: sphere}
  - {name: cone, kind: cone, side: inside}
  - {name: side, kind: plane}
alignment: {plane: top, line: front, point: hole}
characteristics:
  - {quantity: diameter, of: [hole], nominal: 20, tolerance: 0.05}
  - {quantity: distance, of: [hole, bore], nominal: 60, tolerance: [-0.1, 0.1]}
  - {quantity: angle, of: [top, side], nominal: 90, tolerance: 0.2}
  - {quantity: x, of: [dome], nominal: 30}
  - {quantity: cone angle, of: [cone], nominal: 60}
  - {quantity: distance, of: [dome, top], nominal: 4}
  - {quantity: flatness, of: [top], tolerance: 0.05}
  - {quantity: position, of: [bore], tolerance: 0.1}
  - {quantity: perpendicularity, of: [bore], datum: top, tolerance: 0.1}
  - {quantity: perpendicularity, of: [side], datum: top, tolerance: 0.1}
  - {quantity: concentricity, of: [hole], datum: bore, tolerance: 200}
"""
EXPECTED = [20, 60, 90, 30, 60, 4, 0, 0, 0, 0, 120]


def ring(radius: float, x: float, y: float, z: float) -> FloatArray:
    return np.column_stack(
        [x + radius * np.cos(TURN), y + radius * np.sin(TURN), np.full(len(TURN), z)]
    )


def ball_centres() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the centres of the ball at each feature, and its approaches."""
    grid = np.array([[x, y, BALL] for x in (-30, 40, 80) for y in (-25, 25)])
    inward = np.column_stack([np.cos(TURN), np.sin(TURN), 0 * TURN])
    bore = np.vstack([ring(8 - BALL, 60, 0, -2), ring(8 - BALL, 60, 0, -12)])
    normals = np.array(
        [
            [np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)]
            for a in TURN[::2]
            for e in (0.4, 0.9)
        ]
    )
    # A cone of 60 degrees that opens upwards; the centres run on one inside of it.
    half = np.deg2rad(30)
    cone = []
    for z in (-1.0, -5.0):
        on_wall = ring(10 + z * np.tan(half), -30, 40, z)
        out = np.column_stack(
            [
                np.cos(TURN) * np.cos(half),
                np.sin(TURN) * np.cos(half),
                np.full(len(TURN), -np.sin(half)),
            ]
        )
        cone.append(on_wall - BALL * out)
    side = np.array([[-50 - BALL, y, z] for y in (-20, 0, 20) for z in (-3, -9)])
    front = np.array([[x, -40.0 - BALL, -5.0] for x in (-30, 0, 30, 60)])
    unknown = np.full((1, 3), np.nan)
    return {
        "top": (grid, np.tile(-UP, (6, 1))),
        "front": (front, np.tile([[0.0, 1.0, 0.0]], (4, 1))),
        "hole": (ring(10 - BALL, 0, 0, -3), inward),
        "bore": (bore, np.tile(unknown, (len(bore), 1))),
        "dome": (np.array([30, 20, 4.0]) + (5 + BALL) * normals, -normals),
        "cone": (np.vstack(cone), np.tile(unknown, (16, 1))),
        "side": (side, np.tile([[1.0, 0.0, 0.0]], (6, 1))),
    }


def touched() -> PartTouches:
    centres = ball_centres()
    points = np.concatenate([own for own, _ in centres.values()]) @ R.T + T
    approaches = np.concatenate([way for _, way in centres.values()]) @ R.T
    shape = (points - points.mean(axis=0)).ravel() / 100
    covariance = NOISE**2 * np.eye(points.size) + COMMON**2 * np.outer(shape, shape)
    owners = tuple(name for name, (own, _) in centres.items() for _ in own)
    styli = np.tile(R @ UP, (len(points), 1))
    return PartTouches(points, covariance, approaches, styli, owners, BALL)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse_plan(PLAN, "plan.yaml")


@pytest.fixture(scope="module")
def exact(plan: Plan) -> MeasuredPart:
    return measure_part(plan, touched())


def test_exact_touches_give_the_exact_part(exact: MeasuredPart) -> None:
    values = [result.value.value for result in exact.results]

    assert values == pytest.approx(EXPECTED, abs=1e-6)


def test_features_are_reported_in_the_frame_of_the_part(exact: MeasuredPart) -> None:
    top, hole, dome = (exact.features[name].in_part for name in ("top", "hole", "dome"))

    assert top.values[[2, 3, 4, 5]] == pytest.approx([0, 0, 0, 1], abs=1e-9)
    assert hole.values[:2] == pytest.approx([0, 0], abs=1e-9)
    assert dome.values[[0, 1, 2, 6]] == pytest.approx([30, 20, 4, 5], abs=1e-8)


def test_a_value_near_its_limit_is_not_proven(plan: Plan) -> None:
    off = replace_tolerance(plan, 0.001)
    result = measure_part(off, touched()).results[0]

    assert result.decision is Decision.OPEN
    assert result.probability is not None
    assert 0.05 < result.probability < 0.5


def test_the_side_comes_from_the_approach(plan: Plan) -> None:
    auto = Plan(plan.name, (replace_side(plan, "hole"),), characteristics=())
    part = measure_part(auto, only(touched(), "hole"))

    surface = part.features["hole"].surface
    assert surface.quantity.values[6] == pytest.approx(10)
    assert (surface.side, surface.evidence) == ("inside", "approach")


def test_without_an_approach_the_side_comes_from_the_stylus(plan: Plan) -> None:
    touches = only(touched(), "dome")
    unknown = np.full_like(touches.approaches_cam, np.nan)
    auto = Plan(plan.name, (replace_side(plan, "dome"),))
    part = measure_part(auto, replace(touches, approaches_cam=unknown))

    surface = part.features["dome"].surface
    assert surface.quantity.values[6] == pytest.approx(5)
    assert (surface.side, surface.evidence) == ("outside", "stylus")


def test_touches_that_do_not_show_their_side_ask_for_it(plan: Plan) -> None:
    auto = Plan(plan.name, (replace_side(plan, "bore"),))

    with pytest.raises(CalibrationError, match="State 'side: inside'"):
        measure_part(auto, only(touched(), "bore"))


def test_touches_from_both_sides_are_refused(plan: Plan) -> None:
    touches = only(touched(), "hole")
    mixed = touches.approaches_cam * np.where(np.arange(8) % 2, 1, -1)[:, None]

    with pytest.raises(CalibrationError, match="both sides"):
        measure_part(
            Plan(plan.name, (replace_side(plan, "hole"),)),
            replace(touches, approaches_cam=mixed),
        )


def test_missing_touches_are_named(plan: Plan) -> None:
    with pytest.raises(CalibrationError, match="front has 0 probed points"):
        measure_part(plan, only(touched(), "top"))


@pytest.mark.parametrize(
    ("kind", "reported"),
    [
        ("line", "Feature {}: The points are up to .* mm off a line."),
        ("cone", "Feature {}: The points do not determine a cone."),
        ("cylinder", "Feature {}: The points do not determine a cylinder."),
    ],
)
def test_touches_of_another_kind_are_refused(
    plan: Plan, kind: str, reported: str
) -> None:
    flat = next(each for each in plan.features if each.kind is FeatureKind.CIRCLE)
    wrong = structs.replace(flat, kind=FeatureKind(kind), touches=None)
    plan = Plan("Wrong", (wrong,))

    with pytest.raises(CalibrationError, match=reported.format(flat.name)):
        measure_part(plan, touched())


def only(touches: PartTouches, name: str) -> PartTouches:
    at = touches.of(name)
    columns = touches.columns(at)
    return replace(
        touches,
        points_cam=touches.points_cam[at],
        covariance=touches.covariance[np.ix_(columns, columns)],
        approaches_cam=touches.approaches_cam[at],
        styli_cam=touches.styli_cam[at],
        owners=len(at) * (name,),
    )


def replace_tolerance(plan: Plan, tolerance: float) -> Plan:
    import msgspec

    first = msgspec.structs.replace(plan.characteristics[0], tolerance=tolerance)
    return msgspec.structs.replace(plan, characteristics=(first,))


def replace_side(plan: Plan, name: str):  # type: ignore[no-untyped-def]
    import msgspec

    return msgspec.structs.replace(plan.feature(name), side=Side.AUTO, touches=None)


def test_quantities_and_the_simulated_plate_are_shown_in_the_chosen_language() -> None:
    chinese = {"diameter": "直径", "{quantity} {of}": "{of} 的{quantity}"}
    diameter, *_, named = (
        *parse_plan(PLAN, "plan.yaml").characteristics,
        structs.replace(parse_plan(PLAN, "plan.yaml").characteristics[0], name="D1"),
    )

    def translate(template: str) -> str:
        return chinese.get(template, template)

    assert diameter.words.text(translate) == "hole 的直径"
    assert str(diameter.words) == diameter.label == "diameter hole"
    assert named.words.text(translate) == "D1"
    assert plate_plan().words == SIMULATED_PLATE
    assert str(parse_plan(PLAN, "plan.yaml").words) == "Plate"


def test_every_characteristic_of_more_than_a_letter_has_words() -> None:
    assert set(CharacteristicKind) - set(QUANTITIES) == {"x", "y", "z"}
    for kind, words in QUANTITIES.items():
        assert str(words) == kind


THIN = """
name: Thin
features:
  - {name: top, kind: plane}
  - {name: front, kind: line, normal: [0, -1, 0]}
  - {name: hole, kind: circle, side: inside}
  - {name: pad, kind: point, surface: top}
alignment: {plane: top, line: front, point: hole}
characteristics:
  - {quantity: y, of: front, nominal: -40, tolerance: 0.05}
  - {quantity: z, of: pad, nominal: 0, tolerance: 0.05}
"""


def touched_askew() -> PartTouches:
    """Return touches of plane, line, hole and point, to which the ball came askew."""
    touches, places = touched(), ("top", "front", "hole")
    at = np.concatenate([touches.of(name) for name in places])
    pad = np.array([[20.0, 10.0, BALL]]) @ R.T + T
    points = np.concatenate([touches.points_cam[at], pad])
    tilted = R @ rotation_from_vector(np.array([0.25, 0.1, 0.0])) @ -UP
    return PartTouches(
        points,
        NOISE**2 * np.eye(points.size),
        np.concatenate([touches.approaches_cam[at], tilted[None]]),
        np.tile(
            R @ rotation_from_vector(np.array([0.5, 0.0, 0.0])) @ UP, (len(points), 1)
        ),
        (*(touches.owners[i] for i in at), "pad"),
        BALL,
    )


def test_point_and_line_are_compensated_along_the_normal_not_the_approach() -> None:
    part = measure_part(parse_plan(THIN, "thin.yaml"), touched_askew())

    assert [each.value.value for each in part.results] == pytest.approx(
        [-40, 0], abs=1e-6
    )
    assert part.features["pad"].surface.evidence == "plane"
    assert part.features["front"].surface.evidence == "plan"


def test_a_point_takes_the_normal_of_the_plane_that_it_lies_on() -> None:
    text = THIN.replace(", surface: top", "")
    part = measure_part(parse_plan(text, "thin.yaml"), touched_askew())

    assert part.results[1].value.value == pytest.approx(0, abs=1e-6)


def test_a_point_beside_all_planes_is_refused_with_advice() -> None:
    text = THIN.replace(", surface: top", "")
    touches = touched_askew()
    points = touches.points_cam.copy()
    points[-1] += R @ [0.0, 0.0, 5.0]

    with pytest.raises(CalibrationError, match=r"'surface: NAME'.*'side: centre'"):
        measure_part(parse_plan(text, "thin.yaml"), replace(touches, points_cam=points))


def test_the_ball_centre_of_a_point_can_be_asked_for() -> None:
    text = THIN.replace("surface: top", "side: centre")
    part = measure_part(parse_plan(text, "thin.yaml"), touched_askew())

    assert part.results[1].value.value == pytest.approx(BALL, abs=1e-6)


@pytest.mark.slow
def test_u_of_point_and_line_covers_their_errors() -> None:
    rng, held = np.random.default_rng(3), []
    plan, exact = parse_plan(THIN, "thin.yaml"), touched_askew()
    for _ in range(300):
        noise = NOISE * rng.standard_normal(exact.points_cam.shape)
        part = measure_part(plan, replace(exact, points_cam=exact.points_cam + noise))
        held.append(
            [
                abs(each.deviation or 0.0) <= each.value.uncertainty
                for each in part.results
            ]
        )
    share = np.mean(held, axis=0)

    # 300 draws of 95.45 % scatter by 1.2 %.
    assert np.all((share > 0.92) & (share < 0.99)), share


ROUGH = """
name: P
features:
  - {name: top, kind: plane}
  - {name: hole, kind: circle, side: inside}
  - {name: dome, kind: sphere, side: outside}
characteristics:
  - {quantity: diameter, of: hole, nominal: 20}
  - {quantity: diameter, of: dome, nominal: 10}
  - {quantity: distance, of: [dome, top], nominal: 4}
"""


@pytest.mark.slow
@pytest.mark.parametrize("form", [0.0, 0.02])
def test_u_covers_a_feature_whose_few_points_deviate_by_form(form: float) -> None:
    rng = np.random.default_rng(9)
    plan, centres, exact = parse_plan(ROUGH, "rough.yaml"), ball_centres(), touched()
    names = [each.name for each in plan.features]
    at = np.flatnonzero([owner in names for owner in exact.owners])
    ways = np.concatenate([centres[name][1] for name in names]) @ R.T
    touches = replace(
        exact,
        points_cam=exact.points_cam[at],
        covariance=NOISE**2 * np.eye(3 * len(at)),
        approaches_cam=exact.approaches_cam[at],
        styli_cam=exact.styli_cam[at],
        owners=tuple(exact.owners[i] for i in at),
    )
    held = []
    for _ in range(200):
        off = form * rng.standard_normal((len(at), 1)) * ways
        off += NOISE * rng.standard_normal(off.shape)
        part = measure_part(plan, replace(touches, points_cam=touches.points_cam + off))
        held.append(
            [
                abs(each.deviation or 0) <= each.value.uncertainty
                for each in part.results
            ]
        )

    # 200 draws of 95.45 % scatter by 1.5 %; without a variance for form half are held.
    assert np.all(np.mean(held, axis=0) > 0.91), np.mean(held, axis=0)


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ("{quantity: diameter, of: hole, tolerance: 0.1}", "needs the 'nominal'"),
        ("{quantity: perpendicularity, of: top, tolerance: 0.1}", "needs a 'datum'"),
        ("{quantity: diameter, of: top}", "not defined for top .plane."),
        ("{quantity: distance, of: hole}", "not defined for hole .circle."),
        ("{quantity: diameter, of: bore}", "there is no feature 'bore'"),
        (
            "{quantity: diameter, of: {a: 1}}",
            "characteristic 1, of: .* a list in bracket",
        ),
        ("{quantity: size, of: hole}", "'size' is no word that the plan knows there"),
        ("{quantity: diameter}", "the entry 'of' is missing"),
        ("{quantity: diameter, of: hole, nominal: big}", "nominal: .* a number"),
        ("{quantity: x, of: hole, colour: red}", "the entry 'colour' is unknown"),
        ("{quantity: position, of: hole, tolerance: 0.1}", "nominal origin"),
        ("{quantity: flatness, of: top, tolerance: -0.1}", "tolerance -0.1 is none"),
        ("{quantity: distance, of: [hole, hole]}", "names one feature twice"),
    ],
)
def test_an_entry_that_makes_no_sense_is_refused_before_anything_is_measured(
    entry: str, sentence: str
) -> None:
    features = "[{name: top, kind: plane}, {name: hole, kind: circle}]"
    text = f"name: P\nfeatures: {features}\ncharacteristics: [{entry}]\n"

    with pytest.raises(FileError, match=sentence) as raised:
        parse_plan(text, "plan.yaml")
    assert "$" not in str(raised.value)
    assert "`" not in str(raised.value)


def test_a_plan_without_a_plane_asks_for_the_normal_of_a_point_before() -> None:
    text = "name: P\nfeatures: [{name: a, kind: point%s}]\n"
    missing = missing_normal(parse_plan(text % "", "plan.yaml"))

    assert missing is not None
    assert missing.code == "measuring.no-normal"
    for stated in (", normal: [0, 0, 1]", ", side: centre"):
        assert missing_normal(parse_plan(text % stated, "plan.yaml")) is None


def test_one_name_stands_for_a_list_of_one() -> None:
    text = """
name: P
features: [{name: a, kind: plane}]
characteristics: [{quantity: flatness, of: a}]
"""
    plan = parse_plan(text, "plan.yaml")

    assert plan.characteristics[0].of == ("a",)


def test_a_certified_value_is_judged_by_the_limits_of_the_station() -> None:
    text = """
name: Ring
features: [{name: hole, kind: circle, side: inside}]
characteristics: [{quantity: diameter, of: hole, nominal: 19.97, certified: 0.002}]
"""
    plan, touches = parse_plan(text, "ring.yaml"), only(touched(), "hole")
    within = measure_part(plan, touches, VerificationLimits(radius=0.016)).results[0]
    beyond = measure_part(plan, touches, VerificationLimits(radius=0.014)).results[0]

    assert within.deviation == pytest.approx(0.03, abs=1e-6)
    assert (within.decision, beyond.decision) == (Decision.ACCEPTED, Decision.REJECTED)
    plain = measure_part(plate_without_certificate(plan), touches).results[0]
    assert within.value.uncertainty == pytest.approx(
        np.hypot(plain.value.uncertainty, 0.002)
    )


def plate_without_certificate(plan: Plan) -> Plan:
    first = structs.replace(plan.characteristics[0], certified=None)
    return structs.replace(plan, characteristics=(first,))
