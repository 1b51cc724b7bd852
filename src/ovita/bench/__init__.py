"""The benchmark: checks that decide by computation whether an adaptation did what was asked, and its cases."""
