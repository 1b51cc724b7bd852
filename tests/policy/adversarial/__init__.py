"""Hostile policies by topic; see `theatre.py` for how they are staged and what counts as an escape.

Run with nothing around them, about nine in ten of those that could be tried safely left their trace; the others aim at
doors that this version of numpy or Python has walled up.
"""
