"""Baselines: systems that answer an instruction with a trajectory, not with a policy, for comparison.

`baseline_named` makes one by its name, and `adapted_by` runs it as `ovita.adapt` runs a policy writer.
"""

from ovita.baselines.base import Baseline, Deformed, adapted_by
from ovita.baselines.catalogue import NAMES, baseline_named, is_baseline, labelled

__all__ = ["NAMES", "Baseline", "Deformed", "adapted_by", "baseline_named", "is_baseline", "labelled"]
