"""What changed: the measured difference of two trajectories in a scene, as numbers and as plain sentences."""

from ovita.measure.changes import compare
from ovita.measure.report import (
    Changes,
    Displacement,
    Endpoint,
    Insertion,
    Jump,
    Kink,
    ObjectChange,
    ShapeChange,
    Span,
    SpeedChange,
    SpeedRange,
    Stop,
)
from ovita.measure.sentences import sentences, shape_warnings

__all__ = [
    "Changes",
    "Displacement",
    "Endpoint",
    "Insertion",
    "Jump",
    "Kink",
    "ObjectChange",
    "ShapeChange",
    "Span",
    "SpeedChange",
    "SpeedRange",
    "Stop",
    "compare",
    "sentences",
    "shape_warnings",
]
