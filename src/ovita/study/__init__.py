"""Studies with people: what is shown to whom, what they answer, and what the answers amount to.

design        STUDY.toml: what a study asks, of how many people
material      what is shown: items with the answers of each condition, from bench runs
assignment    who sees what, in which order: Williams squares, cross-rating, letters
questions     the instruments
folder        what a study leaves on disk; `answers` keeps what people say, `ratings` is one row an answer
adapting      the adaptation phase: a conversation of one person about one item
pages         the pages, as HTML; `desk` decides which comes, `server` serves them, `offline` writes them as files
statistics    what the answers amount to
"""
