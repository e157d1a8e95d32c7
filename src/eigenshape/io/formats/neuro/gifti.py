"""GIFTI files: surfaces, functions and labels of vertices, in XML. nibabel writes them.

Read: surfaces, functions and labels of all ten types of numbers; text, binary, packed, and in a
    file beside.
Kept: from GIFTI to GIFTI the transformations, metadata and structure.
Named: the transformation and metadata in other formats; parcels of one key; digits that are lost.
Refused: several surfaces; files outside the folder; labels without names as parcels.
"""

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.errors import FileFormatError
from certeig.kit.files import read_regular
from eigenshape.features.parcellation import Parcellation
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import (
    NO_PARCEL,
    UNNAMED,
    Arrays,
    drop_nameless,
    find_labels,
    label_table,
    narrow,
    require_nibabel,
    shared_keys,
)
from eigenshape.io.formats.numbers import ZLIB, require_reasonable, unpack_block
from eigenshape.io.formats.obj_attributes import find_beside
from eigenshape.io.formats.stl import single_precision
from eigenshape.io.formats.xml_arrays import decode_base64, parse_xml, text_numbers

# The standard has uint8, int32 and float32; other programs write more of the types of NIfTI.
NUMBERS = {
    f"NIFTI_TYPE_{np.dtype(kind).name.upper()}": kind
    for kind in ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8")
}
ORDERS = {
    "LittleEndian": "<", "BigEndian": ">", "GIFTI_ENDIAN_LITTLE": "<", "GIFTI_ENDIAN_BIG": ">",
}  # fmt: skip
TEXT = ("ASCII", "GIFTI_ENCODING_ASCII")  # encodings, by their names now and in version 1.0 of 2008
PLAIN = ("Base64Binary", "GIFTI_ENCODING_B64BIN")
PACKED = ("GZipBase64Binary", "GIFTI_ENCODING_B64GZ")
OUTSIDE = ("ExternalFileBinary", "GIFTI_ENCODING_EXTBIN")
POINTS, TRIANGLES, LABELS = "NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE", "NIFTI_INTENT_LABEL"
STRUCTURE = "AnatomicalStructurePrimary"


def parse(
    data: bytes, folder: Path | None = None
) -> tuple[Float[np.ndarray, "n d"], Int[np.ndarray, "f 3"]]:
    """Return vertices and faces; the transformation to other coordinates is not applied.

    Raise FileFormatError if the file does not hold one surface, or not what it declares.
    """
    root = parse_tags(data)
    found = []
    for intent, kind in ((POINTS, "f"), (TRIANGLES, "iu")):
        rows = _values(_only_array(root, intent), len(data), folder)
        if rows.ndim != 2 or rows.shape[1] != 3 or rows.dtype.kind not in kind:
            raise FileFormatError(
                f"{intent} of a GIFTI file must have three numbers a row, coordinates or whole numbers; "
                f"the shape is {rows.shape} and the type {rows.dtype}."
            )
        found.append(rows)
    return found[0].astype(np.float64), found[1].astype(np.int64)


def parse_fields(data: bytes, folder: Path | None = None) -> tuple[Arrays, Arrays]:
    """Return the functions on vertices by name, and none on faces; arrays of one name are columns.

    Raise FileFormatError if the file does not hold what it declares.
    """
    columns: dict[str, list[np.ndarray]] = {}
    for array in parse_tags(data).findall("DataArray"):
        intent = array.get("Intent")
        if intent in (POINTS, TRIANGLES):
            continue
        values = _values(array, len(data), folder)
        name = _meta(array).get("Name", "") or UNNAMED
        before = columns.setdefault(name, [])
        if intent == "NIFTI_INTENT_NODE_INDEX" or (before and len(before[0]) != len(values)):
            raise FileFormatError(
                f"Functions of a GIFTI file must have a value for every vertex; {name!r} is of "
                f"{len(values)} numbers and {intent}."
            )
        before.append(values.reshape(len(values), -1))
    tables = {name: np.hstack(found) for name, found in columns.items()}
    return {
        name: table[:, 0] if table.shape[1] == 1 else table for name, table in tables.items()
    }, {}


def parse_parcels(data: bytes, mesh: TriangleMesh, folder: Path | None = None) -> tuple[Any, ...]:
    """Return the parcellation of a file of labels, and notes; the label named ??? is no parcel.

    Labels without a color get the hues of `Parcellation`.

    Raise FileFormatError if there is not one array of labels, or a label has no name or half a color.
    """
    root = parse_tags(data)
    labels = _values(_only_array(root, LABELS), len(data), folder).ravel()
    keys, names, colors = [], [], []
    for label in root.findall("./LabelTable/Label"):
        name, facts = (label.text or "").strip(), label.attrib
        shades = [facts[each] for each in ("Red", "Green", "Blue") if each in facts]
        words = [*shades, facts.get("Alpha", "1")] if shades and name != NO_PARCEL else []
        try:
            keys.append(int(facts.get("Key", facts.get("Index", ""))))  # Index in files of 2008
            color = list(map(float, words))
        except ValueError:
            color = [np.nan]
        if len(color) not in (0, 4) or not all(0 <= share <= 1 for share in color):
            raise FileFormatError(
                f"Labels of a GIFTI file must have a key and a color; {name!r} has {facts}."
            )
        names.append(name)
        if name != NO_PARCEL:
            colors.append(color)
    if not colors:
        raise FileFormatError(
            "A GIFTI file of labels must have a table of names and colors; it has none. "
            "es.io.read_fields reads its numbers, such as those of a mask."
        )
    places = find_labels("Labels of a GIFTI file", np.array(keys), labels)
    found = Parcellation(*drop_nameless(places, names))
    chosen = [color or hue for color, hue in zip(colors, found.colors.tolist(), strict=True)]
    notes = shared_keys("keys", np.array(keys), names, labels)
    return Parcellation(found.labels, found.names, chosen), *notes


def structure_of(data: bytes) -> str:
    """Return the structure that the file names, such as CortexLeft, or an empty text."""
    root = parse_tags(data)
    found = (_meta(each).get(STRUCTURE) for each in [root, *root.iter("DataArray")])
    return next(filter(None, found), "")


def parse_tags(data: bytes) -> Element:
    """Return the root of a file, and raise FileFormatError if that does not hold its arrays."""
    root = parse_xml(data, "GIFTI")
    count = root.get("NumberOfDataArrays", "")
    if root.tag != "GIFTI" or count.strip() != str(len(root.findall("DataArray"))):
        raise FileFormatError(
            f"A GIFTI file must hold the arrays that it declares; it is {root.tag[:30]!r}, declares "
            f"{count[:30]!r} and holds {len(root.findall('DataArray'))}."
        )
    return root


def _only_array(root: Element, intent: str) -> Element:
    arrays = root.findall(f"DataArray[@Intent='{intent}']")
    if len(arrays) != 1:
        raise FileFormatError(
            f"A GIFTI file of a surface or of parcels must have one array {intent}; it has "
            f"{len(arrays)}. es.io.read_fields reads the functions and labels in it."
        )
    return arrays[0]


def _meta(element: Element) -> dict[str, str]:
    return {
        (pair.findtext("Name") or "").strip(): (pair.findtext("Value") or "").strip()
        for pair in element.findall("./MetaData/MD")
    }


def _values(array: Element, n_bytes: int, folder: Path | None) -> np.ndarray:
    """Return the numbers of an array; `n_bytes` is the size of the file, and `folder` its place."""
    intent, encoding = array.get("Intent", "an array"), array.get("Encoding", "")
    kind, order = NUMBERS.get(array.get("DataType", "")), ORDERS.get(array.get("Endian", ""))
    try:
        count = int(array.get("Dimensionality", ""))
        shape = tuple(int(array.get(f"Dim{axis}", "")) for axis in range(min(count, 3)))
    except ValueError:
        shape = ()
    if kind is None or order is None or not shape or min(shape) < 0:
        raise FileFormatError(
            f"Arrays of a GIFTI file must declare their type, byte order and size; {intent} declares "
            f"{dict(list(array.attrib.items())[:12])}."
        )
    dtype = np.dtype(order + kind)
    size = int(np.prod([float(each) for each in shape])) * dtype.itemsize
    text = (array.findtext("Data") or "").encode()
    if encoding in TEXT:
        data = text_numbers(text, dtype, "GIFTI", intent).astype(dtype).tobytes()
    elif encoding in PLAIN + PACKED:
        data = decode_base64(b"".join(text.split()), "GIFTI", intent)
        if encoding in PACKED:
            require_reasonable(size, n_bytes)
            data = unpack_block(data, size, ZLIB)
    elif encoding in OUTSIDE:
        name, start = array.get("ExternalFileName", ""), array.get("ExternalFileOffset", "") or "0"
        path = find_beside(name, folder) if name and folder else None
        if path is None or not start.isdecimal():
            raise FileFormatError(
                f"Numbers outside a GIFTI file must lie in a file in its folder; {intent} is in "
                f"{name[:80]!r} from byte {start[:30]} on, which is not there. Save it with the data inside."
            )
        data = read_regular(path, "numbers")[int(start) :][:size]
    else:
        raise FileFormatError(
            f"Arrays of a GIFTI file must be text, in base64 or in a file beside it; {intent} is "
            f"{encoding[:30]!r}. Save it with the data inside."
        )
    if len(data) != size:
        raise FileFormatError(
            f"A GIFTI file must hold what it declares; {intent} takes {size} bytes, not {len(data)}."
        )
    is_by_columns = array.get("ArrayIndexingOrder") == "ColumnMajorOrder"
    values = np.frombuffer(data, dtype).reshape(shape, order="F" if is_by_columns else "C")
    return values.astype(dtype.newbyteorder("="))


def format_fields(
    mesh: TriangleMesh, of_vertices: Arrays, of_faces: Arrays, structure: str = ""
) -> bytes:
    """Write a surface and functions on its vertices, in single precision.

    Raise FileFormatError if a number does not fit into 32 bits, or a function is on faces.
    """
    if of_faces:
        raise FileFormatError(
            f"GIFTI files hold functions on vertices; {next(iter(of_faces))!r} is on faces."
        )
    arrays = [(POINTS, "", single_precision(mesh, "GIFTI")), (TRIANGLES, "", mesh.faces)]
    shapes = [("NIFTI_INTENT_SHAPE", name, values) for name, values in of_vertices.items()]
    return _format(arrays + shapes, structure)


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str, structure: str = "") -> bytes:
    """Write functions on vertices alone."""
    intents = {".shape.gii": "NIFTI_INTENT_SHAPE", ".label.gii": LABELS}
    intent = intents.get(suffix, "NIFTI_INTENT_NONE")
    return _format([(intent, name, values) for name, values in of_vertices.items()], structure)


def format_parcels(
    mesh: TriangleMesh, parcellation: Parcellation, suffix: str, structure: str = ""
) -> bytes:
    """Write labels with names and colors; parcel i has the label i + 1, since 0 is for none."""
    return _format([(LABELS, "parcels", parcellation.labels + 1)], structure, parcellation)


def _format(
    arrays: list[tuple[str, str, np.ndarray]],
    structure: str,
    parcellation: Parcellation | None = None,
) -> bytes:
    gifti = require_nibabel("nibabel.gifti")
    table = gifti.GiftiLabelTable()
    if parcellation is not None:
        for key, (name, color) in label_table(parcellation).items():
            label = gifti.GiftiLabel(key, *color)
            label.label = name
            table.labels.append(label)
    named = {STRUCTURE: structure} if structure else {}
    image = gifti.GiftiImage(labeltable=table, meta=gifti.GiftiMetaData(named))
    for intent, name, values in arrays:
        # Of surfaces, Connectome Workbench reads the structure of the points.
        pairs = named if intent == POINTS else {"Name": name} if name else {}
        is_surface = intent in (POINTS, TRIANGLES)
        for column in [values] if is_surface else values.reshape(len(values), -1).T:
            meta, numbers = gifti.GiftiMetaData(pairs), narrow(name, column)
            image.add_gifti_data_array(gifti.GiftiDataArray(numbers, intent=intent, meta=meta))
    return image.to_bytes()
