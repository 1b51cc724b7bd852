"""A policy writer: `ovita adapt ... --writer acme` or `--writer acme:HEIGHT`."""

from ovita.writers.base import Reply, WriterInfo


class AcmeWriter:
    """Arcs over the first object that the instruction names.

    Args:
        model: What follows the colon of its name: the height of the arc [m].
    """

    def __init__(self, model: str) -> None:
        self.name = "acme"
        self.height = float(model or 0.2)

    def write(self, prompt):
        """Answer a prompt (`ovita.writers.base.Prompt`)."""
        request, info = prompt.request, WriterInfo("acme")
        named = [name for name in request.scene.names if name in request.instruction.lower()]
        if not named:
            return Reply("not_understood", unplaced=(request.instruction,), writer=info)
        code = f"""def adapt(traj, scene, *, height={self.height!r}):
    thing = scene[{named[0]!r}]
    return arc_over(traj, thing, height)
"""
        return Reply("policy", plan=(f"Fly over the {named[0]} in an arc.",), code=code, writer=info)
