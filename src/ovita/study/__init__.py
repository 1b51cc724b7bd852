"""Studies with people: what is shown to whom, what they answer, and what the answers amount to."""
