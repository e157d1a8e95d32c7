"""`python -m eigenshape`: the command line."""

from eigenshape_command import main

main()
