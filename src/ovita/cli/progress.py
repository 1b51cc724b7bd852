"""Progress on anything that takes longer than a second."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ovita.writers.progress import Progress


@contextmanager
def waiting(what: str, *, quiet: bool = False) -> Iterator[Progress]:
    """Show a spinner on standard error while the block runs, if that is a terminal.

    Yields:
        A function that puts another text next to the spinner; any thread may call it.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(what)) as status:
        yield lambda text: status.update(Text(text))
