"""Hostile policies by topic; see `theatre.py` for how they are staged and what counts as an escape."""
