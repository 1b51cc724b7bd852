"""Drone missions: QGroundControl plans, QGC WPL text, and what both have in common."""
