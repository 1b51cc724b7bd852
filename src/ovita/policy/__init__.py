"""Policies: reading them, checking them, and running them where they can compute and nothing else."""

from ovita.policy.parameters import Parameter
from ovita.policy.policy import Policy

__all__ = ["Parameter", "Policy"]
