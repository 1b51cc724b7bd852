"""The grammar of generated instructions: words, scenes, and clauses with their checks."""

from ovita.bench.grammar.clauses import FAMILIES, MAKERS, Clause, Maker
from ovita.bench.grammar.lexicon import CLAUSES, Split, vocabulary, words
from ovita.bench.grammar.scenes import SETTINGS, Setting, random_scene

__all__ = [
    "CLAUSES",
    "FAMILIES",
    "MAKERS",
    "SETTINGS",
    "Clause",
    "Maker",
    "Setting",
    "Split",
    "random_scene",
    "vocabulary",
    "words",
]
