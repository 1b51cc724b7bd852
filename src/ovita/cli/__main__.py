"""`python -m ovita.cli`."""

from ovita.cli.main import main

main()
