"""What changed: the measured difference of two trajectories in a scene, as numbers and as plain sentences."""

from ovita.measure.changes import compare
from ovita.measure.matching import dwells
from ovita.measure.report import Changes, Displacement, Endpoint, ObjectChange, Span, SpeedChange, SpeedRange, Stop
from ovita.measure.sentences import sentences

__all__ = [
    "Changes",
    "Displacement",
    "Endpoint",
    "ObjectChange",
    "Span",
    "SpeedChange",
    "SpeedRange",
    "Stop",
    "compare",
    "dwells",
    "sentences",
]
