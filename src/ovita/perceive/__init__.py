"""Perception: from depth pictures to the objects of a scene."""

from ovita.perceive.assemble import Perceived, perceive
from ovita.perceive.detect import Detector, Found
from ovita.perceive.view import View

__all__ = ["Detector", "Found", "Perceived", "View", "perceive"]
