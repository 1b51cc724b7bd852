"""What changed: the measured difference of two trajectories in a scene, as numbers and as plain sentences."""

from ovita.changes.matching import dwells
from ovita.changes.measure import measure
from ovita.changes.report import Changes, Displacement, Endpoint, ObjectChange, Span, SpeedChange, SpeedRange, Stop
from ovita.changes.sentences import sentences

__all__ = [
    "Changes",
    "Displacement",
    "Endpoint",
    "ObjectChange",
    "Span",
    "SpeedChange",
    "SpeedRange",
    "Stop",
    "dwells",
    "measure",
    "sentences",
]
