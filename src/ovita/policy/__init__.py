"""Policies: reading them, checking them, and running them where they can compute and nothing else."""

from ovita.policy.policy import Policy
from ovita.policy.source import Parameter

__all__ = ["Parameter", "Policy"]
