"""The parameters of requests: each is declared once, checked by that, and told to programs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from starlette.requests import Request


class RequestError(Exception):
    """A request is answered with a status of HTTP and a sentence."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


@dataclass(frozen=True)
class Parameter:
    """A parameter in the address of a request.

    Attributes
    ----------
    name : str
    kind : {"string", "strings", "integer", "boolean", "integers"}
        A boolean is 0 or 1; strings are given by a parameter each, integers are separated by
        commas.
    text : str
        What it means.
    default : object
        The value where it is missing. REQUIRED if it must be given.
    low, high : int
        Bounds of an integer; `high` also bounds the number of integers, and of letters.
    """

    name: str
    kind: Literal["string", "strings", "integer", "boolean", "integers"]
    text: str
    default: Any = None
    low: int = 0
    high: int = 4096

    def read(self, texts: list[str]) -> Any:
        """Return the value of what was given; raise RequestError if it has none."""
        if self.kind == "strings":
            return [self.parse(text) for text in texts]
        if len(texts) > 1:
            raise RequestError(400, f"The parameter {self.name} must be given once.")
        return self.parse(texts[0])

    def parse(self, text: str) -> Any:
        """Return the value of a text; raise RequestError if there is none."""
        if self.kind in ("string", "strings"):
            if len(text) > self.high:
                raise self._refusal(f"have at most {self.high:,} characters", f"{len(text):,}")
            return text
        if self.kind == "boolean":
            if text not in ("0", "1"):
                raise self._refusal("be 0 or 1", text)
            return text == "1"
        if self.kind == "integers":
            parts = text.split(",") if text else []
            if len(parts) > self.high:
                raise self._refusal(f"have at most {self.high:,} numbers", f"{len(parts):,}")
            return [self._whole(part) for part in parts]
        value = self._whole(text)
        if not self.low <= value <= self.high:
            raise self._refusal(f"lie between {self.low:,} and {self.high:,}", text)
        return value

    def _whole(self, text: str) -> int:
        # More digits than any number here has; int() takes long for thousands of them.
        if not (text.isascii() and text.isdecimal() and len(text) <= 18):
            raise self._refusal("be a whole number, not negative", text)
        return int(text)

    def _refusal(self, rule: str, value: str) -> RequestError:
        return RequestError(400, f"The parameter {self.name} must {rule}; it is {value[:80]!r}.")

    def schema(self) -> dict[str, Any]:
        """Return its description in OpenAPI."""
        schema: dict[str, Any] = {"type": "integer", "enum": [0, 1]}
        if self.kind == "string":
            schema = {"type": "string", "maxLength": self.high}
        elif self.kind == "strings":
            schema = {"type": "array", "items": {"type": "string", "maxLength": self.high}}
        elif self.kind == "integer":
            schema = {"type": "integer", "minimum": self.low, "maximum": self.high}
        elif self.kind == "integers":
            items = {"type": "integer", "minimum": 0}
            schema = {"type": "array", "items": items, "maxItems": self.high}
        if self.default is not REQUIRED and self.default is not None:
            schema["default"] = self.default if self.kind == "string" else int(self.default)
        described = {
            "name": self.name,
            "in": "query",
            "required": self.default is REQUIRED,
            "description": self.text,
            "schema": schema,
        }
        if self.kind == "integers":
            described |= {"style": "form", "explode": False}
        return described


REQUIRED = object()


def read_parameters(request: Request, parameters: Sequence[Parameter]) -> dict[str, Any]:
    """Return the values of all parameters of a request.

    Raises
    ------
    RequestError
        If one is unknown, missing, given too often, or not what it must be.
    """
    known = {parameter.name: parameter for parameter in parameters}
    given = request.query_params
    for name in given:
        if name not in known:
            names = ", ".join(known) or "none"
            raise RequestError(
                400, f"There is no parameter {name[:80]!r} here; the parameters are: {names}."
            )
    values = {}
    for name, parameter in known.items():
        if name in given:
            values[name] = parameter.read(given.getlist(name))
        elif parameter.default is REQUIRED:
            raise RequestError(400, f"The parameter {name} must be given. {parameter.text}")
        else:
            values[name] = parameter.default
    return values
