"""``python -m flyball`` is the ``flyball`` command."""

from .cli import main

main()
