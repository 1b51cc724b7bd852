"""Baselines in a benchmark: every answer is recorded, and a record answers again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ovita.baselines import Baseline, Deformed
from ovita.errors import TrajectoryError, WriterError
from ovita.io import trajectory_rows
from ovita.io.waypoints import trajectory_from_rows
from ovita.request import Request


class RecordingBaseline:
    """A baseline that delegates to another and records every answer and failure."""

    def __init__(self, inner: Baseline) -> None:
        self._inner = inner
        self.name, self.keeps_limits = inner.name, inner.keeps_limits
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    def deform(self, request: Request) -> Deformed:
        """Answer as the inner baseline does.

        Raises:
            WriterError: As the inner baseline does.
        """
        limits = {"keeps_limits": self.keeps_limits}
        try:
            answer = self._inner.deform(request)
        except WriterError as error:
            self.replies.append({"error": str(error), "unreached": error.unreached, **limits})
            raise
        said = {"matched": answer.matched, "similarity": answer.similarity}
        self.replies.append({"trajectory": trajectory_rows(answer.trajectory), **said, **limits})
        return answer


class ReplayingBaseline:
    """Answers as the baseline of that name did, with replies as `RecordingBaseline.replies` holds them."""

    def __init__(self, name: str, replies: Sequence[Mapping[str, Any]]) -> None:
        self.name, self._left = name, list(replies)
        self.keeps_limits = any(reply.get("keeps_limits") for reply in replies)
        self.replies: list[dict[str, Any]] = []
        self.waited = 0.0

    def deform(self, request: Request) -> Deformed:
        """Give the next recorded answer.

        Raises:
            WriterError: If that was a failure, or there is none left.
        """
        if not self._left:
            raise WriterError(f"{self.name}: the record holds no further answer; run it again without --replay")
        kept = dict(self._left.pop(0))
        self.replies.append(kept)
        if "error" in kept:
            raise WriterError(str(kept["error"]), "no_answer" if kept.get("unreached") else "other")
        try:
            path = trajectory_from_rows(kept.get("trajectory"), timestep=request.trajectory.timestep)
        except TrajectoryError:
            raise WriterError(f"{self.name}: the recorded answer cannot be read; run it again") from None
        return Deformed(path, kept.get("matched", ""), kept.get("similarity"))
