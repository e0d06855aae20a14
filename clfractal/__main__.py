"""`python -m clfractal` is the command `clfractal`."""

from clfractal.cli import main

main()
