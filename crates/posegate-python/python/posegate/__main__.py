"""`python -m posegate`: the program `posegate`."""

from ._program import main

main()
