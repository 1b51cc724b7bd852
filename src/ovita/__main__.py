"""`python -m ovita`: the command line."""

from ovita.cli.main import main

main()
