"""Phases one and two: grounding an instruction, and the writers that answer it with a policy."""
