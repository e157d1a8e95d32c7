"""The calls of the service, as they are checked and as OpenAPI describes them."""

from typing import Any

import eigenshape as es
from eigenshape_studio.service.parameters import REQUIRED, Parameter

MOST_MATCHES = 100
MOST_LISTED = 1000  # shapes of one page of the list
MOST_POINTS = 500  # whose numbers fit into an address

SHAPE_NAME = Parameter("name", "string", "Name of a shape of the index.", REQUIRED)
SHAPE_ID = Parameter(
    "id",
    "integer",
    "Number of the shape in an earlier answer; the status is 404 if another one has its name now.",
    None,
    0,
    2**53,
)
FILTER = Parameter(
    "filter",
    "strings",
    "Only shapes that meet a condition: label=cat, tag=scanned, or by an attribute height=1.5..3. "
    "label=cat,dog allows either, and label!=cat all others. May be repeated; all conditions must be met.",
)
QUERY = (
    Parameter(
        "name",
        "string",
        f"Name of the file; its suffix says the format: {', '.join(es.io.SHAPE_FORMATS)}.",
        REQUIRED,
    ),
    Parameter("n", "integer", "Matches to return at most.", 5, 1, MOST_MATCHES),
    FILTER,
    Parameter("exact", "boolean", "1 compares every shape of the index.", False),
    Parameter(
        "picture", "boolean", "1 returns a picture of the scan, with its described points.", False
    ),
)
SHAPES = (
    Parameter("offset", "integer", "Shapes to leave out at the beginning.", 0, 0, 2**53),
    Parameter("limit", "integer", "Shapes to return at most.", 100, 1, MOST_LISTED),
    FILTER,
)
ADD = (
    Parameter("name", "string", "Name of the new shape.", REQUIRED),
    Parameter("file", "string", "Name of the file; its suffix says the format.", REQUIRED),
    Parameter("label", "string", "Class of the shape."),
    Parameter("tag", "strings", "A tag of the shape. May be repeated."),
    Parameter("attributes", "string", 'Numbers and texts by name, as JSON: {"height": 1.5}.', "{}"),
    Parameter("replace", "boolean", "1 replaces a shape of the same name.", False),
)
POINTS = (
    SHAPE_NAME,
    SHAPE_ID,
    Parameter(
        "vertices",
        "integers",
        "Numbers of vertices, separated by commas.",
        REQUIRED,
        0,
        MOST_POINTS,
    ),
)
THUMBNAIL = (
    SHAPE_NAME,
    SHAPE_ID,
    Parameter(
        "drawn",
        "boolean",
        "1 draws the file of the shape, as /v1/points sees it, even if the index holds a picture.",
        False,
    ),
)

TEXT = {"type": "string"}
NUMBER = {"type": "number"}
WHOLE = {"type": "integer"}
PAIR = {"type": "array", "items": WHOLE, "minItems": 2, "maxItems": 2}
PLACE = {"type": ["array", "null"], "items": NUMBER, "minItems": 2, "maxItems": 2}
MAYBE_TEXT = {"type": ["string", "null"]}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": list(properties)}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


SOURCE = MAYBE_TEXT | {"description": "File of the shape, if the service was told to show it."}
SHAPE = {
    "id": WHOLE
    | {"description": "Its number, which no other shape has, also none that replaces it."},
    "name": TEXT,
    "label": MAYBE_TEXT,
    "tags": _list(TEXT),
    "attributes": {
        "type": "object",
        "additionalProperties": {"type": ["number", "string"]},
    },
    "source": SOURCE,
    "thumbnail": MAYBE_TEXT | {"description": "Address of its picture; null if it has none."},
}
SCHEMAS = {
    "Error": _object(error=TEXT | {"description": "A sentence that says what to change."}),
    "Shape": _object(**SHAPE),
    "Shapes": _object(
        n_shapes=WHOLE | {"description": "Number of shapes, of those that the filters choose."},
        shapes=_list({"$ref": "#/components/schemas/Shape"}),
    ),
    "Match": _object(
        **SHAPE,
        score=NUMBER | {"description": "Near 0 for the same shape; smaller is more alike."},
        chance={
            "type": ["number", "null"],
            "description": "Share of unrelated shapes that would score as well, if it is known.",
        },
        mirrored={
            "type": ["boolean", "null"],
            "description": "Whether the shape is rather like a mirror image of the scan, if that can be told.",
        },
        n_pairs=WHOLE | {"description": "Number of points that correspond."},
        pairs=_list(PAIR)
        | {"description": "Vertices that correspond, of the scan and of the shape; surest first."},
    ),
    "Answer": _object(
        scan=_object(name=TEXT, n_vertices=WHOLE, n_faces=WHOLE, repairs=_list(TEXT)),
        method={"type": "string", "enum": ["exact", "staged", "candidates"]},
        n_compared=WHOLE | {"description": "Shapes that were compared exactly."},
        nothing_alike={
            "type": "boolean",
            "description": "Whether the best score is no better than those of unrelated shapes.",
        },
        seconds=_object(describe=NUMBER, search=NUMBER),
        matches=_list({"$ref": "#/components/schemas/Match"}),
        picture={
            "type": ["object", "null"],
            "description": "The scan: a data address, and place and color of each described vertex.",
            "properties": {
                "image": TEXT,
                "points": {"type": "object", "additionalProperties": PLACE},
                "colors": {"type": "object", "additionalProperties": TEXT},
            },
        },
    ),
    "Points": _object(
        thumbnail=MAYBE_TEXT
        | {"description": "Address of the picture in which they lie; null if there is none."},
        points=_list(PLACE),
    ),
    "Compacted": _object(bytes=WHOLE | {"description": "Bytes that were given back."}),
    "Health": _object(status=TEXT, shapes=WHOLE, version=TEXT),
}


def _json(name: str, text: str) -> dict[str, Any]:
    content = {"application/json": {"schema": {"$ref": f"#/components/schemas/{name}"}}}
    return {"description": text, "content": content}


def _bytes(text: str, *kinds: str) -> dict[str, Any]:
    return {"description": text, "content": {kind: {} for kind in kinds}}


def _call(
    summary: str,
    answer: dict[str, Any],
    parameters: tuple[Parameter, ...] = (),
    status: str = "200",
    **errors: str,
) -> dict[str, Any]:
    """Return the description of a call; errors are given as status_400="When it happens."."""
    statuses = {name.removeprefix("status_"): _json("Error", text) for name, text in errors.items()}
    return {
        "summary": summary,
        "parameters": [parameter.schema() for parameter in parameters],
        "responses": {
            status: answer,
            **statuses,
            "403": _json("Error", "The token is missing, wrong, or none for this call."),
        },
    }


UPLOAD = {
    "requestBody": {
        "required": True,
        "description": "The bytes of a mesh file.",
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
UPLOAD_ERRORS = {
    "status_408": "The bytes came too slowly.",
    "status_413": "The file is too large.",
    "status_415": "The body is not application/octet-stream.",
    "status_422": "The file holds no mesh that can be described; the text says why.",
}
BAD_PARAMETER = "A parameter is missing, unknown or out of range."
NO_SHAPE = "The index holds no such shape."
PATH_NAME = {
    "name": "name",
    "in": "path",
    "required": True,
    "description": "Name of a shape, with % escapes.",
    "schema": TEXT,
}
PATHS: dict[str, dict[str, Any]] = {
    "/v1/query": {
        "post": _call(
            "Find the shapes of the index that are most like a scan.",
            _json("Answer", "The most similar shapes, best first."),
            QUERY,
            status_400=BAD_PARAMETER,
            **UPLOAD_ERRORS,
            status_503="Too many queries wait already; ask again later.",
        )
        | UPLOAD
    },
    "/v1/shapes": {
        "get": _call(
            "List the shapes of the index, sorted by name.",
            _json("Shapes", "Some of the shapes, and how many there are."),
            SHAPES,
            status_400=BAD_PARAMETER,
        ),
        "post": _call(
            "Add a shape to the index, described by a mesh file. Takes the token for writing.",
            _json("Shape", "The new shape."),
            ADD,
            status="201",
            status_400=BAD_PARAMETER,
            status_409="The index has a shape of that name, and replace is not 1.",
            **UPLOAD_ERRORS,
            status_503="Too many meshes wait already, or another process writes.",
        )
        | UPLOAD,
    },
    "/v1/shapes/{name}": {
        "get": _call(
            "Tell what is known of one shape.", _json("Shape", "The shape."), status_404=NO_SHAPE
        )
        | {"parameters": [PATH_NAME]},
        "delete": _call(
            "Remove a shape from the index. Takes the token for writing.",
            _json("Shape", "What was known of the shape."),
            status_404=NO_SHAPE,
            status_405="The service only reads.",
            status_503="Another process writes.",
        )
        | {"parameters": [PATH_NAME]},
    },
    "/v1/compact": {
        "post": _call(
            "Give the space of removed shapes back. Takes the token for writing.",
            _json("Compacted", "What was given back."),
            status_400=BAD_PARAMETER,
            status_415=UPLOAD_ERRORS["status_415"],
            status_503="Another process writes.",
        )
    },
    "/v1/thumbnails": {
        "get": _call(
            "Return the picture of a shape.",
            _bytes("The picture.", "image/png", "image/webp"),
            THUMBNAIL,
            status_400=BAD_PARAMETER,
            status_404="The index holds no such shape, or no picture and no readable file of it.",
        )
    },
    "/v1/points": {
        "get": _call(
            "Tell where vertices of a shape lie in its picture.",
            _json("Points", "Shares of width and height, right and down; null for hidden ones."),
            POINTS,
            status_400=BAD_PARAMETER,
            status_404=NO_SHAPE,
        )
    },
    "/health": {
        "get": _call(
            "Say whether the service works. Needs no token.",
            _json("Health", "It does."),
            status_503="The index cannot be read.",
        )
        | {"security": []}
    },
    "/metrics": {
        "get": _call("Return counters for Prometheus.", _bytes("The counters.", "text/plain"))
    },
}


def openapi(prefix: str = "") -> dict[str, Any]:
    """Return the description of all calls below a path, of version 3.1 of OpenAPI."""
    return {
        "openapi": "3.1.0",
        "servers": [{"url": prefix or "/"}],
        "info": {
            "title": "eigenshape",
            "version": es.__version__,
            "description": "Search for similar shapes by a scan, whole or partial, in any pose.",
        },
        "paths": PATHS,
        "components": {
            "schemas": SCHEMAS,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        "security": [{"token": []}],
    }
