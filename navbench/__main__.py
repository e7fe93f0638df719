"""Run the program ``navbench``."""

from navbench.cli.app import main

main()
