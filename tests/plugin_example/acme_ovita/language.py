"""A policy writer: `ovita adapt ... --writer acme` or `--writer acme:HEIGHT`."""

from ovita.writers.base import Reply, WriterInfo


class AcmeWriter:
    """Bows the path upwards where the instruction says "bow", and understands nothing else.

    Args:
        model: What follows the colon of its name: the height of the bow [m].
    """

    def __init__(self, model: str) -> None:
        self.name = "acme"
        self.height = float(model or 0.2)

    def write(self, prompt):
        """Answer a prompt (`ovita.writers.base.Prompt`)."""
        said, info = prompt.request.instruction, WriterInfo("acme")
        if "bow" not in said.lower():
            return Reply("not_understood", unplaced=(said,), writer=info)
        code = f"""def adapt(traj, scene, *, height={self.height!r}):
    return acme_bow(traj, height)
"""
        return Reply("policy", plan=("Bow the path upwards.",), code=code, writer=info)
