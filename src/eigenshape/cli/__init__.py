"""The command line, one file a verb."""

from eigenshape.cli.app import app

__all__ = ["app"]
