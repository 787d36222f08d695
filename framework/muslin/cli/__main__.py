"""`python -m muslin.cli`."""

from muslin.cli import main

main()
