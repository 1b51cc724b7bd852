"""Pairs of language and motion at any scale, each verified by a check of its own."""
