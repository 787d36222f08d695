"""Lawful mesh files of every format come out as the same cloth."""

import malformed
import meshio
import numpy as np
import pytest

from muslin.base.errors import MeshError
from muslin.base.paths import meshes
from muslin.mesh import Mesh, area_and_normal, grid, load, save, unstructured
from muslin.mesh.shipped import SHIPPED, write

SQUARE_V = malformed.SQUARE_V


def loaded(tmp_path, name: str, content: str | bytes) -> Mesh:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return load(path)


def is_unit_square(mesh: Mesh) -> bool:
    area, normal = area_and_normal(mesh.vertices, mesh.triangles)
    return bool(np.isclose(area.sum(), 1) and np.allclose(normal, [0, 0, 1]))


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".vtk", ".vtu"])
def test_saving_and_loading_keeps_every_digit(suffix, tmp_path):
    mesh = unstructured(1.0, 0.7, spacing=0.13, seed=3)
    path = tmp_path / f"cloth{suffix}"
    save(mesh, path)
    again = load(path)
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)
    assert again.name == "cloth"
    assert again.notices == ()
    assert again.vertices.dtype == np.float64
    assert again.triangles.dtype == np.int32


def test_stl_is_welded_where_corners_are_equal_and_says_so(tmp_path):
    mesh = unstructured(1.0, 0.7, spacing=0.13)
    save(mesh, tmp_path / "cloth.stl")
    again = load(tmp_path / "cloth.stl")
    assert again.vertices.shape == mesh.vertices.shape
    np.testing.assert_array_equal(again.vertices[again.triangles], mesh.vertices[mesh.triangles])
    assert f"{3 * len(mesh.triangles)} corners welded into {len(mesh.vertices)}" in again.notices[0]


def test_binary_stl_is_welded_too(tmp_path):
    mesh = loaded(tmp_path, "a.stl", malformed.binary_stl(malformed.SQUARE_STL))
    assert mesh.vertices.shape == (4, 3)
    assert is_unit_square(mesh)


@pytest.mark.parametrize("kind", ["gmsh", "gmsh22"])  # versions 4.1 and 2.2
@pytest.mark.parametrize("binary", [False, True])
def test_gmsh_files_of_each_version_load(kind, binary, tmp_path):
    mesh = grid(4, 3)
    written = meshio.Mesh(mesh.vertices, [("triangle", mesh.triangles)])
    written.write(tmp_path / "cloth.msh", file_format=kind, binary=binary)
    again = load(tmp_path / "cloth.msh")
    np.testing.assert_allclose(again.vertices, mesh.vertices, rtol=1e-14)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)


@pytest.mark.parametrize("suffix", [".ply", ".vtk", ".vtu"])
@pytest.mark.parametrize("binary", [False, True])
def test_text_and_binary_of_a_format_agree(suffix, binary, tmp_path):
    mesh = grid(4, 3)
    written = meshio.Mesh(mesh.vertices, [("triangle", mesh.triangles)])
    written.write(tmp_path / f"cloth{suffix}", binary=binary)
    again = load(tmp_path / f"cloth{suffix}")
    np.testing.assert_allclose(again.vertices, mesh.vertices, rtol=1e-10)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_our_text_readers_agree_with_meshio_where_both_can_read(suffix, tmp_path):
    mesh = unstructured(1.0, 0.7, spacing=0.2)
    written = meshio.Mesh(mesh.vertices, [("triangle", mesh.triangles)])
    path = tmp_path / f"cloth{suffix}"
    written.write(path, **({"binary": False} if suffix == ".ply" else {}))
    ours, theirs = load(path), meshio.read(path)
    np.testing.assert_array_equal(ours.vertices, theirs.points)
    np.testing.assert_array_equal(ours.triangles, theirs.cells_dict["triangle"])


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3\nf 1 3 4\n",
        "f -4 -3 -2\nf -4 -2 -1\n",
        "vt 0 0\nvt 1 1\nf 1/1 2/2 3/1\nf 1/1 3/1 4/2\n",
        "vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n",
        "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\n",
        "g a\ns off\nusemtl red\nf 1 2 3\ng b\nf 1 3 4 # the other half\n",
        "f 1 2 \\\n3\nf 1 3 4",
        "f 1 2 3\r\nf 1 3 4\r\n",
    ],
    ids=["plain", "relative", "textured", "with normals", "both", "groups", "continued", "CRLF"],
)
def test_obj_faces_are_understood_in_every_spelling(faces, tmp_path):
    mesh = loaded(tmp_path, "a.obj", SQUARE_V + faces)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])
    assert mesh.notices == ()


def test_relative_obj_indices_count_from_where_they_stand(tmp_path):
    mesh = loaded(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -4 -2 -1\n")
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])


def test_obj_vertices_may_carry_weights_or_colours(tmp_path):
    text = "v 0 0 0 1\nv 1 0 0 1\nv 1 1 0 1 .5 .5\nv 0 1 0\n" + malformed.SQUARE_F
    assert is_unit_square(loaded(tmp_path, "a.obj", text))


def test_a_byte_order_mark_and_an_upper_case_extension_do_no_harm(tmp_path):
    assert is_unit_square(
        loaded(tmp_path, "A.OBJ", b"\xef\xbb\xbf" + (SQUARE_V + malformed.SQUARE_F).encode())
    )


@pytest.mark.parametrize(
    "text",
    [
        "OFF\n4 2 5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
        "OFF # a square\n\n# counts\n4  2\n0 0 0\n1 0 0 # corner\n\n1 1 0\n0 1 0\n3 0 1 2\n# half\n3 0 2 3\n",
        "OFF 4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3  0 2 3 0 255 0\n",
        "COFF\n4 2 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n1 1 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2\n3 0 2 3\n",
    ],
    ids=["plain", "comments", "face colours", "vertex colours"],
)
def test_off_is_understood_in_every_spelling(text, tmp_path):
    mesh = loaded(tmp_path, "a.off", text)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])
    assert is_unit_square(mesh)


def test_ascii_ply_may_hold_colours_edges_and_other_lists(tmp_path):
    text = (
        "ply\nformat ascii 1.0\ncomment made by hand\n"
        "element vertex 4\nproperty uchar red\nproperty double x\n"
        "property double y\nproperty double z\nelement face 2\nproperty list uchar float texcoord\n"
        "property list uchar int vertex_index\nproperty uchar flags\nelement edge 1\nproperty int vertex1\n"
        "property int vertex2\nend_header\n"
        "9 0 0 0\n9 1 0 0\n9 1 1 0\n9 0 1 0\n2 .1 .2 3 0 1 2 7\n0 3 0 2 3 7\n0 1\n"
    )
    mesh = loaded(tmp_path, "a.ply", text)
    assert is_unit_square(mesh)
    assert "1 edge element left out" in mesh.notices[0]


def test_binary_ply_of_the_usual_kind_loads(tmp_path):
    assert is_unit_square(loaded(tmp_path, "a.ply", malformed.binary_ply()))


def test_vtk_and_vtu_text_written_by_hand_load(tmp_path):
    assert is_unit_square(loaded(tmp_path, "a.vtk", malformed.vtk()))
    assert is_unit_square(loaded(tmp_path, "a.vtu", malformed.vtu()))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.obj", SQUARE_V + "f 1 2 3 4\n"),
        ("a.off", malformed.off(malformed.SQUARE_XYZ, "4 0 1 2 3\n", counts="4 1 0")),
        ("a.ply", malformed.ply(malformed.SQUARE_XYZ, "4 0 1 2 3\n", m=1)),
        ("a.vtk", malformed.vtk(cells="4 0 1 2 3\n", types="9\n")),
        ("a.vtu", malformed.vtu(connectivity="0 1 2 3", offsets="4", types="9")),
        ("a.msh", malformed.msh2("1 3 2 0 1 1 2 3 4\n")),
    ],
)
def test_a_quad_is_cut_into_two_triangles_with_a_notice(name, content, tmp_path):
    mesh = loaded(tmp_path, name, content)
    assert mesh.triangles.shape == (2, 3)
    assert is_unit_square(mesh)
    assert len(mesh.notices) == 1
    assert "1 quad cut into 2 triangles" in mesh.notices[0]


def test_a_quad_is_cut_along_the_better_diagonal_and_never_outside_itself(tmp_path):
    dart = loaded(tmp_path, "dart.obj", "v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nf 2 3 4 1\n")
    area, normal = area_and_normal(dart.vertices, dart.triangles)
    assert np.isclose(area.sum(), 0.5)
    assert np.allclose(normal, normal[0])
    flat = loaded(tmp_path, "flat.obj", "v -3 0 0\nv 0 -1 0\nv 3 0 0\nv 0 1 0\nf 1 2 3 4\n")
    assert all({1, 3} <= set(t) for t in flat.triangles.tolist()), (
        "the shorter diagonal joins vertices 1 and 3"
    )


def test_polygons_mixed_with_triangles_keep_the_order_of_the_file(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 0 1 0\nv 3 0 0\nf 1 2 5 6\nf 3 7 4\nf 2 3 4 5\n"
    mesh = loaded(tmp_path, "a.obj", text)
    area, normal = area_and_normal(mesh.vertices, mesh.triangles)
    assert np.isclose(area.sum(), 2.5)
    assert np.allclose(normal, [0, 0, 1])
    np.testing.assert_array_equal(mesh.triangles[2], [2, 6, 3])
    assert "2 quads cut into 4 triangles" in mesh.notices[0]


def test_a_concave_pentagon_is_cut_inside_itself(tmp_path):
    text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n"
    mesh = loaded(tmp_path, "a.obj", text)
    area, normal = area_and_normal(mesh.vertices, mesh.triangles)
    assert np.isclose(area.sum(), 2.5)
    assert np.allclose(normal, [0, 0, 1])
    assert "1 larger polygon cut into 3 triangles" in mesh.notices[0]


def test_points_and_lines_are_left_out_with_the_vertices_only_they_use(tmp_path):
    mesh = loaded(tmp_path, "a.obj", "v 5 5 5\n" + SQUARE_V + "v 6 6 6\nl 1 6 2\np 1\nf 2 3 4\nf 2 4 5\n")
    assert is_unit_square(mesh)
    assert mesh.vertices.shape == (4, 3)
    assert "1 line element, 1 point element left out, with 2 vertices" in mesh.notices[0]
    mesh = loaded(
        tmp_path, "a.msh", malformed.msh2("1 15 2 0 1 1\n2 1 2 0 1 1 2\n3 2 2 0 1 1 2 3\n4 2 2 0 1 1 3 4\n")
    )
    assert is_unit_square(mesh)
    assert "1 vertex element, 1 line element left out" in mesh.notices[0]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.obj", SQUARE_V + "v 9 9 9\n" + malformed.SQUARE_F, "vertex 5 (line 5) is in no triangle"),
        ("a.vtk", malformed.vtk(malformed.SQUARE_XYZ + "2 0 0\n3 0 0\n", n=6), "2 vertices in no triangle"),
        # An arc of a Gmsh geometry has its centre among the nodes.
        (
            "a.msh",
            malformed.msh2(nodes="1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 9 9 9\n"),
            "vertex 4 (counting from 0) is in no triangle",
        ),
    ],
)
def test_vertices_in_no_triangle_are_left_out_with_a_notice(name, content, words, tmp_path):
    mesh = loaded(tmp_path, name, content)
    assert is_unit_square(mesh)
    assert mesh.vertices.shape == (4, 3)
    assert len(mesh.notices) == 1
    assert words in mesh.notices[0]


def test_vertices_keep_the_numbers_of_the_file_where_others_are_left_out(tmp_path):
    mesh = loaded(tmp_path, "a.obj", "v 7 7 7\n" + SQUARE_V + "v 8 8 8\nf 2 3 4\nf 2 4 5\n")
    np.testing.assert_array_equal(mesh.vertices[mesh.find([1, 3])], [[0, 0, 0], [1, 1, 0]])
    assert mesh.called(mesh.find([4, 2])) == [4, 2]
    for number, words in ((0, "left out"), (5, "no vertex 5"), (-1, "no vertex -1")):
        with pytest.raises(MeshError, match=words):
            mesh.find(number)


def test_several_pieces_of_a_vtu_are_one_mesh(tmp_path):
    far = malformed.vtu(pieces=2).decode()
    first, second = far.split("</Piece>", 1)
    moved = second.replace("0 0 0 1 0 0 1 1 0 0 1 0", "0 0 5 1 0 5 1 1 5 0 1 5")
    mesh = loaded(tmp_path, "a.vtu", first + "</Piece>" + moved)
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    np.testing.assert_array_equal(mesh.vertices[:, 2], [0, 0, 0, 0, 5, 5, 5, 5])


def test_flat_coordinates_get_a_third_one_with_a_notice(tmp_path):
    text = SQUARE_V.replace(" 0\n", "\n") + malformed.SQUARE_F
    for mesh in (
        loaded(tmp_path, "a.obj", text),
        Mesh.from_arrays([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]]),
    ):
        assert is_unit_square(mesh)
        assert "two coordinates" in mesh.notices[0]


def test_vertices_that_coincide_are_noticed_not_refused(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n"
    mesh = loaded(tmp_path, "a.obj", text)
    assert mesh.vertices.shape == (6, 3)
    assert "2 vertices lie exactly on another one" in mesh.notices[0]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_mesh_is_what_its_generator_makes(name, tmp_path):
    write(tmp_path)

    def numbers(path, keyword):
        lines = path.read_text().splitlines()
        return np.array([[float(t) for t in line.split()[1:]] for line in lines if line.startswith(keyword)])

    for keyword in ("v ", "f "):
        np.testing.assert_allclose(
            numbers(meshes() / name, keyword), numbers(tmp_path / name, keyword), atol=1e-9
        )


@pytest.mark.parametrize("name", SHIPPED)
def test_the_readme_of_the_shipped_meshes_counts_right(name):
    mesh = load(meshes() / name)
    row = next(line for line in (meshes() / "README.md").read_text().splitlines() if f"`{name}`" in line)
    triangles = "16 quads" if name == "quads.obj" else str(len(mesh.triangles))
    assert row.endswith(f"| {len(mesh.vertices)} | {triangles} |")


def test_the_course_square_has_its_400_vertices_and_722_triangles():
    mesh = load(meshes() / "course-square.obj")
    assert mesh.vertices.shape == (400, 3)
    assert mesh.triangles.shape == (722, 3)
    assert np.abs(mesh.vertices[:, :2]).max() == 0.5
    assert is_unit_square(mesh)
