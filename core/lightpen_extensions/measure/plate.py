"""The part of the simulated station: a plate of ten features, and its measuring plan.

Its frame has the origin in the middle of the upper face, x to the right, y away from
the camera and z up. `verification.tasks.part` states where it lies.
"""

from functools import cache

from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.measuring.plan_checks import parse_plan

PLATE = """
name: Simulated plate
features:
  - {name: top, kind: plane, touches: 6,
     nominal: {origin: [0, 0, 0], axis: [0, 0, 1], length: 120, width: 60}}
  - {name: front, kind: line, touches: 3, normal: [0, -1, 0],
     nominal: {origin: [0, -35, -5], axis: [1, 0, 0], length: 100}}
  - {name: hole 1, kind: circle, side: inside, touches: 4,
     nominal: {origin: [-50, -20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 2, kind: circle, side: inside, touches: 4,
     nominal: {origin: [50, -20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 3, kind: circle, side: inside, touches: 4,
     nominal: {origin: [50, 20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 4, kind: circle, side: inside, touches: 4,
     nominal: {origin: [-50, 20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: bore, kind: cylinder, side: inside, touches: 8,
     nominal: {origin: [0, 0, -12], axis: [0, 0, 1], diameter: 30, length: 20}}
  - {name: dome, kind: sphere, side: outside, touches: 6,
     nominal: {origin: [-25, 0, 2], axis: [0, 0, 1], diameter: 20}}
  - {name: countersink, kind: cone, side: inside, touches: 8,
     nominal:
       {origin: [25, 0, -5], axis: [0, 0, 1], diameter: 24, angle: 90, length: 8}}
  - {name: pad, kind: point, surface: top,
     nominal: {origin: [0, 24, 0], axis: [0, 0, 1]}}
alignment: {plane: top, line: front, point: bore}
characteristics:
  - {quantity: flatness, of: [top], tolerance: 0.2}
  - {quantity: diameter, of: [hole 1], nominal: 24, tolerance: 0.2}
  - {quantity: diameter, of: [bore], nominal: 30, tolerance: 0.2}
  - {quantity: diameter, of: [dome], nominal: 20, tolerance: 0.2}
  - {quantity: cone angle, of: [countersink], nominal: 90, tolerance: 2}
  - {quantity: y, of: [front], nominal: -35, tolerance: 0.2}
  - {quantity: z, of: [pad], nominal: 0, tolerance: 0.2}
  - {quantity: distance, of: [hole 1, hole 2], nominal: 100, tolerance: 0.2}
  - {quantity: distance, of: [hole 1, hole 4], nominal: 40, tolerance: 0.2}
  - {quantity: position, of: [hole 3], tolerance: 0.4}
  - {quantity: perpendicularity, of: [bore], datum: top, tolerance: 0.3}
"""


@cache
def plate_plan() -> Plan:
    """Return the measuring plan of the plate."""
    return parse_plan(PLATE, "plate.yaml")
