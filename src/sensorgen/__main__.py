"""``python -m sensorgen``: for where the ``sensorgen`` command is not on the path."""

from sensorgen.cli import main

main()
