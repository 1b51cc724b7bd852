"""What changed: the measured difference of two trajectories in a scene, as numbers and as plain sentences."""

from ovita.measure.account import account
from ovita.measure.changes import Changes, compare
from ovita.measure.sentences import moved_ends, sentences, shape_warnings

__all__ = ["Changes", "account", "compare", "moved_ends", "sentences", "shape_warnings"]
