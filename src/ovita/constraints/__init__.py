"""Constraints: what a robot may do, and the nearest trajectory that it may follow.

`constrain` is the whole module; `verify` measures without changing anything.
"""

from ovita.constraints.problem import ConstraintCheck, ConstraintOptions, Solution, Verdict, Violation
from ovita.constraints.solve import constrain
from ovita.constraints.verify import verify

__all__ = ["ConstraintCheck", "ConstraintOptions", "Solution", "Verdict", "Violation", "constrain", "verify"]
