"""Where trajectories come from: planners (`planner`, `legal`, `sampling`, `mpc`, `joints`) and words (`words`).

`ovita.plan` plans from place to place, `ovita.from_words` from a sentence; see docs/sources.md.
"""
