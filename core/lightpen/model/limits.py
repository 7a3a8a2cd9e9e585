"""The limits of a station: for a swing, for verifications, and for the age of a tip.

A limit is a field made by `_limit`, with label, unit and range: the dialog of limits,
the options of the command line and the stored limits iterate over `LIMITS`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime, timedelta
from math import isfinite, radians
from typing import Any

from lightpen.messages import Message, message
from lightpen.model.coverage import Decision, DecisionRule, decide

IMAGES = LEAST_IMAGES, MOST_IMAGES = 10, 2000
MOST_DAYS = 3650
SMALLEST = 1e-12  # mm, above 0


@dataclass(frozen=True)
class Limit:
    """A limit that a supervisor sets."""

    part: str  # field of `StationLimits`
    name: str  # field of that part
    default: float
    label: Message
    unit: str  # empty of a count, and of a choice
    range: tuple[float, float]
    choices: tuple[Message, ...] = ()  # the value is the index of one of them
    options: tuple[Any, ...] = ()  # value of each choice

    @property
    def key(self) -> str:
        """Name among stored entries."""
        prefix = {"swing": "", "verification": "max_", "due": "due_"}[self.part]
        unit = self.unit.replace("%", "percent")
        return prefix + self.name + (f"_{unit}" if unit else "")


def _limit(
    default: float,
    label: Message,
    unit: str = "mm",
    between: tuple[float, float] = (0.0001, 10.0),
) -> Any:
    described = {"default": default, "label": label, "unit": unit, "range": between}
    return field(default=default, metadata=described)


RULES = tuple(DecisionRule)


_RULE_NAMES = {
    DecisionRule.SIMPLE: message("decision-rule.simple"),
    DecisionRule.GUARD_BAND: message("decision-rule.guard-band"),
    DecisionRule.RISK: message("decision-rule.risk"),
}


def rule_name(rule: DecisionRule) -> Message:
    """Return the name of a decision rule with its standard."""
    return _RULE_NAMES[rule]


def _choice(label: Message, options: tuple[Any, ...], *names: Message) -> Any:
    """Return a choice of some options, the first by default."""
    described = {"default": 0.0, "label": label, "unit": "", "options": options}
    described |= {"range": (0.0, len(options) - 1.0), "choices": names}
    return field(default=options[0], metadata=described)


_RULE: Any = _choice(message("limit.rule"), RULES, *map(rule_name, RULES))


@dataclass(frozen=True)
class SwingLimits:
    """Limits on the end of a swing and on the tip."""

    # U (k = 2) of the tip along its weakest direction, mm. A good station reaches it
    # with 100 images at 0.03 px, or 300 at 0.05 px even if its files state nothing.
    max_uncertainty: float = _limit(0.012, message("limit.max-uncertainty"))
    min_images: int = _limit(60, message("limit.min-images"), "", IMAGES)
    max_images: int = _limit(300, message("limit.max-images"), "", IMAGES)
    min_per_field: int = 2  # images in each field of the dial
    spacing: float = radians(2.5)  # between kept postures
    # Whether a tip passes only if the temperature of the pen was measured.
    requires_temperature: bool = _choice(
        message("limit.temperature"),
        (False, True),
        message("temperature.optional"),
        message("temperature.required"),
    )

    def __post_init__(self) -> None:
        counts = self.min_images, self.min_per_field, self.max_images - 1
        if not (self.max_uncertainty > 0 and self.spacing >= 0 and min(counts) >= 0):
            raise ValueError(f"Nothing can be swung by {self}.")


@dataclass(frozen=True)
class VerificationLimits:
    """Maximum deviations of a verification, mm, and the rule that judges them."""

    # Error of the tip: a task verifies the tip if it would find one as large.
    tip: float = _limit(0.04, message("limit.tip"))
    # Standard deviation of a fixed point perpendicular to the line of sight (u, v) and
    # along it (w), where one camera resolves some ten times less.
    across: float = _limit(0.01, message("limit.across"))
    along: float = _limit(0.03, message("limit.along"))
    # Error of the mean radius of a circle.
    radius: float = _limit(0.02, message("limit.radius"))
    # Roundness of a circle and its deviation from a plane; excess of a certified form.
    form: float = _limit(0.1, message("limit.form"))
    # Error of a length: a constant, and what each metre adds to it.
    length: float = _limit(0.03, message("limit.length"))
    length_per_m: float = _limit(0.0, message("limit.length-per-m"), "mm", (0.0, 10.0))
    # Standard deviation of a coordinate of the tip over calibrations.
    repeatability: float = _limit(0.01, message("limit.repeatability"))
    # How far a drift reference may move during a session.
    drift: float = _limit(0.02, message("limit.drift"))
    rule: DecisionRule = _RULE  # comparison of a value and its U with its limit
    # Of a wrong decision, where the rule is the risk, percent.
    risk: float = _limit(5.0, message("limit.risk"), "%", (0.1, 50.0))

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            least = 0.0 if item.name == "length_per_m" else SMALLEST
            if item.name != "rule" and not (isfinite(value) and value >= least):
                raise ValueError(f"`{item.name}` must be above 0, got {value}.")

    def length_error(self, length: float) -> float:
        """Return the maximum permissible error of a length, mm."""
        return self.length + self.length_per_m * length / 1000

    def decision(self, value: float, uncertainty: float, limit: float) -> Decision:
        """Return whether a value with its U (k = 2) keeps a limit either way, mm."""
        return decide(
            self.rule,
            value,
            uncertainty,
            lower=-limit,
            upper=limit,
            max_risk=self.risk / 100,
        )


@dataclass(frozen=True)
class DueRule:
    """Calibration interval of a tip."""

    # Days since it was calibrated.
    max_days: int = _limit(30, message("limit.max-days"), "", (1, MOST_DAYS))

    def __post_init__(self) -> None:
        if self.max_days < 1:
            raise ValueError(f"No tip can be due by {self}.")

    def due(self, accepted: datetime) -> datetime:
        """Return when a tip is due by its age."""
        return accepted + timedelta(days=self.max_days)


@dataclass(frozen=True)
class StationLimits:
    """All limits of a station."""

    swing: SwingLimits = field(default_factory=SwingLimits)
    verification: VerificationLimits = field(default_factory=VerificationLimits)
    due: DueRule = field(default_factory=DueRule)

    def value(self, limit: Limit) -> float:
        """Return the value of a limit."""
        value = getattr(getattr(self, limit.part), limit.name)
        return float(limit.options.index(value) if limit.choices else value)

    def with_values(self, values: Mapping[str, float]) -> "StationLimits":
        """Return these limits with other values, by `Limit.key`; counts are rounded."""
        parts = {name: dict[str, Any]() for name in PARTS}
        for limit in LIMITS:
            value = values.get(limit.key, self.value(limit))
            if limit.choices:
                if not 0 <= round(value) < len(limit.options):
                    raise ValueError(f"`{limit.key}` has no choice {value}.")
                parts[limit.part][limit.name] = limit.options[round(value)]
            else:
                parts[limit.part][limit.name] = value if limit.unit else round(value)
        changed = {n: replace(getattr(self, n), **new) for n, new in parts.items()}
        return replace(self, **changed)


PARTS = {"swing": SwingLimits, "verification": VerificationLimits, "due": DueRule}
LIMITS = tuple(
    Limit(part, each.name, **each.metadata)
    for part, kind in PARTS.items()
    for each in fields(kind)
    if each.metadata
)


COLDEST, WARMEST = -50.0, 100.0  # degrees C, of a pen


def _option(
    default: float | None,
    name: str,
    unit: str,
    between: tuple[float, float],
    meaning: str,
) -> Any:
    """Return an assumption that ``lightpen calibrate`` takes as an option."""
    described = {"option": name, "unit": unit, "range": between, "help": meaning}
    return field(default=default, metadata=described)


BALL_UNCERTAINTY = 0.001  # mm, U (k = 2) of the diameter of a ball with a certificate


@dataclass(frozen=True)
class Assumptions:
    """Default standard uncertainties for what files do not state.

    Those of the camera are typical errors of the file of a lens that was mounted and
    focused again after its calibration. The others concern the station: temperature of
    the pen, form of ball and cone.

    Attributes
    ----------
    focal_length : float
        Relative standard uncertainty of the focal length.
    aspect : float
        Relative standard uncertainty of fy / fx.
    principal_point : float
        Standard uncertainty of cx and of cy, px.
    k1, k2, tangential : float
        Standard uncertainty of the distortion coefficients; ``tangential`` applies to
        p1 and p2.
    scale : float
        Relative standard uncertainty of the scale of all LED coordinates.
    expansion : float
        Thermal expansion of the pen, 1/K: 2e-6 (carbon fibre) to 23e-6 (aluminium).
    expansion_share : float
        Relative standard uncertainty of a stated expansion coefficient.
    temperature_c : float or None
        Temperature of the pen during the swing, degrees Celsius; None if not measured.
    humidity_percent : float or None
        Relative humidity during the swing, for the record; None if not measured.
    temperature : float
        Standard uncertainty of the temperature, K.
    warmth : float
        Standard uncertainty of the temperature difference from the LED measurement, if
        the temperature during the swing was not measured, K.
    diameter : float
        Relative standard uncertainty of the LED disc diameter.
    form_error : float
        Standard uncertainty of the seat of the ball by the form error of ball and cone,
        along each axis in each form of dependence on the tilt, mm.
    center_bias : float
        Standard uncertainty of the centre of an LED's image, px, by errors that do not
        average out: different in each posture, equal whenever the posture returns.
    rotation, translation : float
        Standard uncertainty of the pose of a camera in its rig about and along each
        axis, rad and mm.
    """

    focal_length: float = 0.005
    aspect: float = 0.0003
    principal_point: float = 5.0
    k1: float = 0.02
    k2: float = 0.1
    tangential: float = 0.0003
    scale: float = _option(
        1e-5,
        "scale-sigma",
        "SHARE",
        (1e-9, 0.1),
        "standard uncertainty of the scale of the pen, for example 20e-6, if the LED "
        "file states none",
    )
    expansion: float = 2.3e-5
    expansion_share: float = 0.1
    temperature_c: float | None = _option(
        None,
        "temperature",
        "CELSIUS",
        (COLDEST, WARMEST),
        "pen temperature, for thermal expansion",
    )
    humidity_percent: float | None = _option(
        None, "humidity", "PERCENT", (0.0, 100.0), "relative humidity, for the record"
    )
    temperature: float = 0.5
    warmth: float = 1.5  # U (k = 2) of 3 K
    diameter: float = 0.05
    form_error: float = _option(
        0.0002,
        "form-error",
        "MM",
        (1e-7, 1.0),
        "standard uncertainty due to the form error of ball and cone (0.0002)",
    )
    center_bias: float = _option(
        0.003,
        "center-bias",
        "PX",
        (1e-6, 10.0),
        "systematic standard uncertainty of LED centres (0.003)",
    )
    rotation: float = 0.02
    translation: float = 20.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name == "temperature_c":
                if value is not None and not COLDEST <= value <= WARMEST:
                    raise ValueError(f"{value} degrees C is no temperature of a pen.")
            elif item.name == "humidity_percent":
                if value is not None and not 0 <= value <= 100:
                    raise ValueError(f"{value} % is no relative humidity.")
            elif not (isfinite(value) and value >= 0):
                raise ValueError(f"`{item.name}` must be 0 or more, got {value}.")


USUAL = Assumptions()


def with_focal_length(assumptions: Assumptions, sigma: float) -> Assumptions:
    """Return assumptions with another relative uncertainty of the focal length.

    A camera that is known better in one respect is so in all, as a rule.
    """
    times = sigma / assumptions.focal_length
    names = ("focal_length", "aspect", "principal_point", "k1", "k2", "tangential")
    return replace(
        assumptions, **{name: times * getattr(assumptions, name) for name in names}
    )
