"""A lawful file is read right in whatever way it is written down; cut or corrupted it is refused, and in no time."""

import importlib.util
import io
import warnings
import zlib

import mesh_variants
import meshio
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mesh_variants import POINTS, QUADS, TRIANGLES, VARIANTS

from muslin.base.errors import MeshError
from muslin.mesh import Mesh, area_and_normal, check, load


def read(folder, name: str, content: bytes) -> Mesh:
    (folder / name).write_bytes(content)
    return load(folder / name)


def read_or_refuse(folder, name: str, content: bytes) -> Mesh | None:
    """The mesh, or None where one clear line refuses it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # nothing is printed besides
            return read(folder, name, content)
    except MeshError as error:
        refusal = error
    assert str(refusal).isprintable(), "one line"
    assert "Traceback" not in str(refusal)
    assert refusal.hint
    return None


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_the_mesh_it_says(name, tmp_path):
    if "LZ4" in name and importlib.util.find_spec("lz4") is None:
        pytest.skip("without the package lz4")
    mesh = read(tmp_path, name, VARIANTS[name])
    if name.endswith(".stl"):  # has no vertices of its own: numbered in the order of their first use
        np.testing.assert_array_equal(mesh.vertices[mesh.triangles], POINTS[TRIANGLES])
        assert len(mesh.vertices) == len(POINTS)
        return
    np.testing.assert_array_equal(mesh.vertices, POINTS)
    assert mesh.numbers is None
    if "quads" in name:
        assert any("6 quads cut into 12 triangles" in notice for notice in mesh.notices)
    if (
        "quads" in name or "strips" in name
    ):  # cut along some diagonal, but the same side up and the same squares
        _, normal = area_and_normal(mesh.vertices, mesh.triangles)
        _, upward = area_and_normal(POINTS, TRIANGLES)
        assert len(mesh.triangles) == len(TRIANGLES)
        assert (normal @ upward.mean(axis=0) > 0).all()
        pairs = {
            tuple(sorted({*a, *b})) for a, b in zip(mesh.triangles[::2], mesh.triangles[1::2], strict=True)
        }
        assert pairs == {tuple(sorted(quad)) for quad in QUADS.tolist()}
        return
    np.testing.assert_array_equal(mesh.triangles, TRIANGLES)


def test_there_are_many_variants_of_every_format():
    endings = [name.rsplit(".", 1)[1] for name in VARIANTS]
    assert {ending: endings.count(ending) for ending in set(endings)} == {
        "ply": 33, "stl": 13, "vtk": 46, "vtu": 36, "vtp": 32,
    }  # fmt: skip


def test_trimesh_reads_the_same_corners_where_it_can(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    compared = 0
    for name, content in VARIANTS.items():
        if not name.endswith((".ply", ".stl")) or "quads" in name:  # it cuts quads in its own way
            continue
        try:
            theirs = trimesh.load(io.BytesIO(content), file_type=name[-3:], process=False)
            corners = theirs.vertices[theirs.faces]
        except Exception:
            continue
        if len(corners) == len(TRIANGLES):
            mesh = read(tmp_path, name, content)
            np.testing.assert_array_equal(mesh.vertices[mesh.triangles], corners, err_msg=name)
            compared += 1
    assert compared >= 19


def test_meshio_reads_the_same_arrays_where_it_can(tmp_path):
    compared = 0
    for name, content in VARIANTS.items():
        if not name.endswith((".vtk", ".vtu", ".ply")):
            continue
        (tmp_path / name).write_bytes(content)
        try:
            theirs = meshio.read(tmp_path / name)
            faces = theirs.cells_dict["triangle"]
        except (Exception, SystemExit):
            continue
        if len(faces) == len(TRIANGLES):
            mesh = load(tmp_path / name)
            np.testing.assert_array_equal(mesh.vertices, theirs.points, err_msg=name)
            np.testing.assert_array_equal(mesh.triangles, faces, err_msg=name)
            compared += 1
    assert compared >= 10


@pytest.mark.parametrize("layout", ["vtk42", "vtk"])
@pytest.mark.parametrize("binary", [False, True])
def test_both_layouts_that_meshio_writes_are_read(layout, binary, tmp_path):
    written = meshio.Mesh(
        POINTS,
        [("triangle", TRIANGLES)],
        point_data={"height": POINTS[:, 2]},
        cell_data={"row": [np.arange(len(TRIANGLES))]},
    )
    written.write(tmp_path / "a.vtk", file_format=layout, binary=binary)
    mesh = load(tmp_path / "a.vtk")
    np.testing.assert_array_equal(mesh.vertices, POINTS)
    np.testing.assert_array_equal(mesh.triangles, TRIANGLES)


def test_lz4_without_its_package_is_named_with_the_remedy(tmp_path, monkeypatch):
    from muslin.mesh import vtkxml

    def absent(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(vtkxml, "import_module", absent)
    with pytest.raises(MeshError, match="compressed with LZ4") as caught:
        read(tmp_path, "a.vtu", VARIANTS["grid.raw-little-UInt32-LZ4.vtu"])
    assert "pip install lz4" in caught.value.hint
    assert "zlib" in caught.value.hint


def test_a_block_that_unpacks_to_more_than_it_says_is_refused(tmp_path):
    bomb = zlib.compress(bytes(50_000_000))
    file = mesh_variants.VtkXml("raw", pack="ZLib")
    file._packed = lambda data: (np.array([1, 144, 0, len(bomb)], "<u4").tobytes(), bomb)
    with pytest.raises(MeshError, match="not what their sizes promise"):
        read(tmp_path, "a.vtu", file.grid(TRIANGLES.tolist(), 5))


#: Whoever cuts or changes these may leave the geometry whole: what stands in for the promise of a length.
SAMPLE = sorted(name for name in VARIANTS if not ("LZ4" in name or "UInt64" in name))


@settings(max_examples=400, deadline=None)
@given(name=st.sampled_from(SAMPLE), where=st.floats(0, 1))
def test_a_file_cut_anywhere_is_refused_or_still_holds_the_mesh(name, where, tmp_path_factory):
    content = VARIANTS[name]
    cut = content[: int(where * len(content))]
    assume(len(content[len(cut) :].split()) != 1)  # a number without its last digits is a number
    mesh = read_or_refuse(tmp_path_factory.mktemp("cut"), name, cut)
    if mesh is None:
        return
    assert len(mesh.triangles) == len(TRIANGLES)
    assert sorted(map(tuple, mesh.vertices.tolist())) == sorted(map(tuple, POINTS.tolist()))


@settings(max_examples=800, deadline=None)
@given(name=st.sampled_from(SAMPLE), data=st.data())
def test_a_corrupted_file_is_refused_or_still_cloth(name, data, tmp_path_factory):
    content = bytearray(VARIANTS[name])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        change = data.draw(st.sampled_from(["byte", "delete", "repeat", "huge"]))
        if change == "byte":
            content[at] = data.draw(st.integers(0, 255))
        elif change == "delete":
            del content[at : at + data.draw(st.integers(1, 40))]
        elif change == "repeat":
            content[at:at] = content[at : at + data.draw(st.integers(1, 40))]
        else:  # a number that promises more than there can be
            content[at : at + 4] = data.draw(
                st.sampled_from([b"\xff\xff\xff\xff", b"9999", b"\x7f\xff\xff\xff"])
            )
        if not content:
            return
    mesh = read_or_refuse(tmp_path_factory.mktemp("bad"), name, bytes(content))
    if mesh is not None:
        check(mesh)
