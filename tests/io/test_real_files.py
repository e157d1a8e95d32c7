"""Real files, awkward ones first; counts were taken from the files by hand, headers and plain counting of lines."""

import csv
import re

import pytest

from eigenshape import EigenshapeError, read_mesh
from eigenshape.geometry import surface_area

pytestmark = pytest.mark.data

MESHES = {
    "geometrycentral/bob_small.ply": (250, 500),
    "geometrycentral/cat_head.obj": (131, 248),
    "geometrycentral/dodecahedron_poly.obj": (20, 36),
    "geometrycentral/fan3.obj": (5, 3),
    "geometrycentral/fox.ply": (313, 622),
    "geometrycentral/hourglass_ico.obj": (23, 40),
    "geometrycentral/lego.ply": (1649, 3072),
    "geometrycentral/moebius.obj": (280, 448),
    "geometrycentral/platonic_shelf.obj": (50, 80),
    "geometrycentral/sphere_small.ply": (162, 320),
    "geometrycentral/stl_box_ascii.stl": (8, 12),
    "geometrycentral/stl_box_binary.stl": (8, 12),
    "geometrycentral/tet.obj": (4, 4),
    "geometrycentral/triple_vierbein.obj": (75, 108),
    "openmesh/cube-minimal-custom_props.ply": (8, 12),
    "openmesh/cube-minimal-degenerated.obj": (8, 16),
    "openmesh/cube-minimal-extra-elements-binary.ply": (8, 12),
    "openmesh/cube-minimal-extra-elements.ply": (8, 12),
    "openmesh/cube-minimal-normals.ply": (8, 12),
    "openmesh/cube-minimal-texCoords.obj": (8, 12),
    "openmesh/cube-minimal-texCoords.ply": (8, 12),
    "openmesh/cube-minimal-texCoords3d.obj": (8, 12),
    "openmesh/cube-minimal-vertex-colors-after-vertex-definition.obj": (8, 12),
    "openmesh/cube-minimal-vertex-colors-as-vc-lines.obj": (8, 12),
    "openmesh/cube-minimal-vertexColors.ply": (8, 12),
    "openmesh/cube-minimal.obj": (8, 12),
    "openmesh/cube-minimal.ply": (8, 12),
    "openmesh/meshlab.ply": (8, 12),
    "openmesh/square_material.obj": (4, 2),
    "openmesh/square_material_texture.obj": (4, 2),
    "own/sliver_pillow.off": (35, 60),
    "pymesh/clipper_input_2.ply": (4, 2),
    "pymesh/cube.obj": (8, 12),
    "pymesh/cube.off": (8, 12),
    "pymesh/cube.ply": (8, 12),
    "pymesh/cube.stl": (8, 12),
    "pymesh/star.obj": (32, 30),
    "pymesh/tet.obj": (4, 4),
    "trimesh/20mm-xyz-cube.stl": (132, 260),
    "trimesh/7_8ths_cube.stl": (14, 24),
    "trimesh/BoxTextured.ply": (24, 12),
    "trimesh/angle_block.STL": (398, 704),
    "trimesh/box.obj": (8, 12),
    "trimesh/comments.off": (8, 12),
    "trimesh/cube.OBJ": (8, 12),
    "trimesh/cube_blender_uv.ply": (24, 12),
    "trimesh/cube_blender_uv_meshlab.ply": (24, 12),
    "trimesh/cube_compressed.obj": (8, 12),
    "trimesh/cubevt.obj": (24, 12),
    "trimesh/cylinder.stl": (210, 416),
    "trimesh/face_in_group_name_mid_file.obj": (5, 2),
    "trimesh/fuze.ply": (502, 1000),
    "trimesh/jacked.obj": (8, 12),
    "trimesh/joined_tetrahedra.obj": (5, 8),
    "trimesh/large_block.STL": (8, 12),
    "trimesh/large_block_obb.STL": (8, 12),
    "trimesh/metadata.ply": (4, 2),
    "trimesh/mirror.ply": (143, 286),
    "trimesh/multi.ply": (4, 2),
    "trimesh/multibody.stl": (20, 32),
    "trimesh/nancolor.obj": (8, 12),
    "trimesh/negative_indices.obj": (8, 12),
    "trimesh/not_convex.obj": (288, 96),
    "trimesh/obj_with_no_face_in_chunk.obj": (3, 1),
    "trimesh/origin_inside.STL": (16, 28),
    "trimesh/plane.ply": (4, 2),
    "trimesh/plane_tri.ply": (4, 2),
    "trimesh/polygonfaces.obj": (5, 3),
    "trimesh/reference.ply": (845, 1610),
    "trimesh/round.stl": (560, 1120),
    "trimesh/shared.STL": (14, 24),
    "trimesh/singlevn.obj": (4, 2),
    "trimesh/soup.stl": (300, 100),
    "trimesh/sphere.ply": (642, 1280),
    "trimesh/teapot.stl": (480, 894),
    "trimesh/tet.ply": (4, 4),
    "trimesh/textured_tetrahedron.obj": (4, 4),
    "trimesh/tube.obj": (128, 120),
    "trimesh/two_objects.obj": (12, 16),
    "trimesh/two_objects_mixed_case_names.stl": (16, 24),
    "trimesh/unit_cube.STL": (8, 12),
    "trimesh/wallhole.obj": (92, 66),
    "trimesh/whitespace.off": (8, 12),
}
REFUSED = {
    "openmesh/pointCloudBadEncoding.ply": "it holds 10 points and no face",
    "openmesh/pointCloudGoodEncoding.ply": "it holds 10 points and no face",
    "pymesh/empty.obj": "must hold a mesh; it is empty",
    "pymesh/empty.off": "it holds 0 points and no face",
    "pymesh/empty.ply": "it holds 0 points and no face",
    "pymesh/empty.stl": "A binary STL file must hold the triangles it declares; 0 take 84 bytes and it has 85",
    "pymesh/polygon.obj": r"it holds 6 triangles in R\^2, which read_shape reads",
    "pymesh/quad.obj": r"it holds 2 triangles in R\^2, which read_shape reads",
    "pymesh/quad_s1.obj": r"it holds 8 triangles in R\^2, which read_shape reads",
    "pymesh/square_2D.obj": r"it holds 2 triangles in R\^2, which read_shape reads",
    "trimesh/empty.obj": "it holds 0 points and no face",
    "trimesh/empty.ply": "it holds 0 points and no face",
    "trimesh/empty.stl": "An STL file must hold triangles; it holds none",
    "trimesh/face_in_group_name.obj": "it holds 1 points and no face",
    "trimesh/notenoughindices.obj": "A face must have three corners or more; line 9 is '1 2'",
    "trimesh/obj_empty.obj": "it holds 0 points and no face",
    "trimesh/obj_points.obj": "it holds 8 points and no face",
    "trimesh/obj_wireframe.obj": r"it holds 12 segments in R\^3",
    "trimesh/ply_empty_ascii.ply": "it holds 0 points and no face",
    "trimesh/ply_empty_bin.ply": "it holds 0 points and no face",
    "trimesh/ply_empty_header.ply": "must declare an element vertex with the numbers x, y and z",
    "trimesh/ply_points_ascii.ply": "it holds 8 points and no face",
    "trimesh/ply_points_bin.ply": "it holds 8 points and no face",
    "trimesh/points_ascii.ply": "it holds 5 points and no face",
    "trimesh/points_ascii_with_lists.ply": "it holds 5 points and no face",
    "trimesh/points_bin.ply": "it holds 5 points and no face",
    "trimesh/points_emptyascii.ply": "A PLY file must hold the rows it declares; it declares 12 in all and holds 13",
    "trimesh/points_emptyface.ply": "it holds 1024 points and no face",
    "trimesh/stl_empty_ascii.stl": "An STL file must hold triangles; it holds none",
    "trimesh/stl_empty_bin.stl": "An STL file must hold triangles; it holds none",
}
CLASSICS = {
    "3holes.off": (3596, 7200),
    "armadillo.obj": (43243, 86482),
    "bunny.off": (3485, 6966),
    "camel.off": (9770, 19536),
    "decimated-max.obj": (5272, 10540),
    "dragon.off": (54296, 108588),
    "eight.off": (766, 1536),
    "elk.off": (5194, 10388),
    "fertility.off": (4494, 9000),
    "genus3.off": (6652, 13312),
    "horse.ply": (48485, 96966),
    "human_neutral.obj": (10475, 20908),
    "koala.obj": (49999, 99994),
    "penguin.obj": (3362, 6720),
    "spot.obj": (11533, 23062),
}


@pytest.mark.filterwarnings("ignore:.*are not read")
def test_every_awkward_file_gives_the_right_mesh_or_a_named_error(data):
    files = {
        path.relative_to(data / "nasty").as_posix(): path
        for path in (data / "nasty").rglob("*")
        if path.is_file()
    }
    assert files.keys() == MESHES.keys() | REFUSED.keys()
    for name, counts in MESHES.items():
        mesh = read_mesh(files[name])
        assert (mesh.n_vertices, mesh.n_faces) == counts, name
    for name, message in REFUSED.items():
        with pytest.raises(EigenshapeError, match=rf"{re.escape(name)}:? .*{message}"):
            read_mesh(files[name])


@pytest.mark.long
def test_classics(data):
    files = {path.name: path for path in (data / "classics").iterdir()}
    assert files.keys() == CLASSICS.keys()
    for name, counts in CLASSICS.items():
        mesh = read_mesh(files[name])
        assert (mesh.n_vertices, mesh.n_faces) == counts, name


def test_everyday_polygons(data):
    for name, area in (("A_prism.obj", 14), ("A_dart.off", 1.5), ("H_quads.npz", 22)):
        assert surface_area(read_mesh(data / "everyday" / name)) == pytest.approx(area), name


def test_point_sets_are_no_meshes(data):
    with pytest.raises(
        EigenshapeError, match=r"fragment_000\.ply: .* it holds 5028 points and no face"
    ):
        read_mesh(data / "points" / "fragment_000.ply")
    for name in ("bunny16k.pts", "chameleon4k.pts", "milk.pcd"):
        with pytest.raises(EigenshapeError, match=rf"{name} must be of a known format"):
            read_mesh(data / "points" / name)


def test_all_shapes_of_the_retrieval_set_have_the_counts_of_its_list(data):
    with (data / "retrieval" / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 296
    for row in rows:
        mesh = read_mesh(data / row["path"])
        assert (mesh.n_vertices, mesh.n_faces) == (int(row["vertices"]), int(row["faces"])), row[
            "path"
        ]
