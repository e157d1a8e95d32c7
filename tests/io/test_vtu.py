"""XML grids that are not what they declare; that good ones are read is tested against VTK itself."""

import pytest
import pyvista as pv
from test_declarations import XML
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from eigenshape import FileFormatError
from eigenshape.io.formats.vtu import parse
from eigenshape.shapes.domains import box

CUBE = box(2, 1, 1)


@pytest.fixture(scope="module")
def binaries(tmp_path_factory):
    """Write a grid appended in base64 and raw, uncompressed, and compressed by LZ4."""
    folder = tmp_path_factory.mktemp("vtu")
    found = {}
    for name, encoded, compressor in (
        ("base64", True, 0),
        ("raw", False, 0),
        ("zlib", True, 1),
        ("lz4", True, 2),
    ):
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetFileName(str(folder / name))
        writer.SetInputData(pv.UnstructuredGrid({10: CUBE.simplices}, CUBE.points))
        writer.SetEncodeAppendedData(encoded)
        writer.SetCompressorType(compressor)
        assert writer.Write()
        found[name] = (folder / name).read_bytes()
    return found


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            ("<VTKFile", "<!DOCTYPE a [<!ENTITY b 'c'>]><VTKFile"),
            "must be plain XML; it declares entities",
        ),
        (("</VTKFile>", ""), "must be whole XML; no element found"),
        (("VTKFile", "VTKfile"), "A VTK file in XML must be a VTKFile; it is a VTKfile"),
        (("Piece", "Part"), "A VTK file must hold pieces with points; it holds none"),
        (
            ("UnstructuredGrid", "ImageData"),
            "must hold an unstructured grid or PolyData; it holds 'ImageData'. In PyVista",
        ),
        (
            ("LittleEndian", "Middle"),
            "byte_order of a VTK file must be LittleEndian or BigEndian; it is 'Middle'",
        ),
        (
            ('NumberOfPoints="4"', 'NumberOfPoints="-4"'),
            "Pieces of a VTK file must count what they hold; NumberOfPoints is '-4'",
        ),
        (
            ('NumberOfPoints="4"', 'NumberOfPoints="5"'),
            "'an array' must have 15 numbers and has 12",
        ),
        (
            ('NumberOfComponents="3"', 'NumberOfComponents="4"'),
            "must have three coordinates each; they have '4'",
        ),
        (("<Points>", "<Pointy>"), "must be whole XML"),
        (("Points>", "Pointy>"), "A VTK file must have points; a piece has none"),
        (('type="Float64"', 'type="String"'), "must be of numbers; 'an array' is of 'String'"),
        (("1 0 0", "1 0 zero"), "must be of numbers; 'an array' is not: could not convert"),
        (
            ("1 0 0", "1 0 1_0"),
            "must be of numbers; 'an array' is not: numbers have no underscores",
        ),
        ((">4<", ">-4<"), r"must rise from 0; they begin with \[-4\]"),
        ((">4<", ">5<"), "'connectivity' must have 5 numbers and has 4"),
        (
            ("0 1 2 3", "0 1 2 3.5"),
            r"connectivity of a VTK file must be whole numbers; number 3 is 3\.5",
        ),
        ((">10<", ">5<"), "A VTK cell of type 5 must have 3 points; cell 0 has 4"),
        (
            ('"connectivity" format="ascii"', '"connectivity" format="appended"'),
            "must have an offset; that of 'conne",
        ),
        ((">0 1 2 3<", 'format="binary">?!<'), "must be whole XML|must be in base64"),
        (
            (
                '"connectivity" format="ascii">0 1 2 3',
                '"connectivity" format="binary">?!??!?!?!?!?',
            ),
            "must be in base64",
        ),
    ],
)
def test_broken_tags_and_texts_are_named(change, match):
    assert change[0] in XML
    with pytest.raises(FileFormatError, match=match):
        parse(XML.replace(*change).encode())


def test_broken_binaries_are_named(binaries):
    assert parse(binaries["raw"])[1]["tetrahedra"].tolist() == CUBE.simplices.tolist()
    with pytest.raises(FileFormatError, match="'Points' takes 240 bytes, not"):
        parse(binaries["raw"].replace(b'NumberOfPoints="12"', b'NumberOfPoints="10"'))
    with pytest.raises(
        FileFormatError, match="A VTK file must hold what it declares; 'Points' takes 240 bytes"
    ):
        parse(binaries["zlib"].replace(b'NumberOfPoints="12"', b'NumberOfPoints="10"'))
    for name in ("base64", "raw", "zlib"):
        end = binaries[name].rindex(b"</AppendedData")
        with pytest.raises(
            FileFormatError, match=r"must hold what it declares; '.*' lacks|must be in base64"
        ):
            parse(binaries[name][: end - 60] + binaries[name][end:])
    with pytest.raises(FileFormatError, match="or not at all; it is by 'vtkZip'"):
        parse(binaries["lz4"].replace(b"vtkLZ4DataCompressor", b"vtkZip"))


def test_a_count_of_blocks_beyond_the_file(binaries):
    start = binaries["zlib"].index(b'encoding="base64"')
    start = binaries["zlib"].index(b"_", start) + 1
    with pytest.raises(FileFormatError, match=r"'.*' is of \d+ blocks"):
        parse(binaries["zlib"][:start] + b"////f///" + binaries["zlib"][start + 8 :])
