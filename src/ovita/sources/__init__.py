"""Where trajectories come from: planners, words alone, and skills that are learned from demonstrations.

`ovita.plan` plans from place to place (`planner`, `legal`, `sampling`, `mpc`, `joints`), `ovita.from_words` from a
sentence (`words`); see docs/sources.md. `ovita.learn` learns a skill (`learning`, `skills`); see docs/skills.md.
"""
