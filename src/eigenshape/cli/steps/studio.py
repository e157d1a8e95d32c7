"""The door to the studio, for its verbs."""

from eigenshape.plot.view import studio_module as studio_module  # noqa: PLC0414  in the stub
