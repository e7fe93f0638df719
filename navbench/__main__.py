"""Run the program ``navbench``."""

from harness.cli.app import main

main()
