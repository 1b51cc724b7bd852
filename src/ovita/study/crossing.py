"""Cross-rating: people judge what other people adapted, as in the paper's rating phase."""

from __future__ import annotations

import random
from collections import Counter

from ovita.study.answers import StudyProgress, progress_of, work_of
from ovita.study.assignment import Participant, StudyPage
from ovita.study.folder import StudyFolder


def draw(study: StudyFolder, person: Participant) -> str:
    """Draw the result of another person for this one to judge: "p07/s002", or "" while there is none.

    Those that fewest people were shown come first, among them items that this person has not seen rated. Nobody judges
    an item that they adapted themselves, and nobody judges a result twice.
    """
    everybody = [progress_of(study, other) for other in study.participants.values()]
    seen = Counter(event.of for progress in everybody for event in progress.events if event.event == "shown")
    mine = next(progress for progress in everybody if progress.person.id == person.id)
    had = {event.of for event in mine.events}
    open_ = [
        (f"{progress.person.id}/{page.id}", page.item)
        for progress in everybody
        if progress.person.id != person.id and not progress.withdrawn
        for page in progress.person.pages
        if page.kind == "adapt" and page.id in progress.answered and page.item not in person.adapted
    ]
    left = sorted((of, item) for of, item in open_ if of not in had)
    if not left:
        return ""
    random.Random(f"ovita cross-rating {study.design.seed} {person.id} {len(had)}").shuffle(left)
    return min(left, key=lambda lot: (seen[lot[0]], lot[1] in person.rated))[0]


def whose(study: StudyFolder, of: str) -> tuple[StudyProgress, StudyPage]:
    """The person whose result it is, as far as they are, and the page on which they adapted."""
    person, page = work_of(study, of)
    return progress_of(study, person), page
