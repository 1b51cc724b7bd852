"""Policies: reading them, checking them, and running them where they can compute and nothing else."""

from ovita.policy.policy import Parameter, Policy

__all__ = ["Parameter", "Policy"]
