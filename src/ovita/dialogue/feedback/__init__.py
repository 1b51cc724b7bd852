"""Feedback resolved offline, without any model: "a bit more", "no, only the end", "undo the speed", "the other cup"."""

from ovita.dialogue.feedback.resolution import Resolution
from ovita.dialogue.feedback.resolve import answer, clarified, resolve, together

__all__ = ["Resolution", "answer", "clarified", "resolve", "together"]
