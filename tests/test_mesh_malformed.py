"""Every mesh that cannot be cloth is refused in one paragraph that names file, place and trouble."""

import os
import warnings

import malformed
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.base.errors import MeshError
from muslin.mesh import Mesh, check, grid, load, save


@pytest.mark.parametrize("name", malformed.MALFORMED)
def test_a_malformed_file_is_refused_with_its_name_and_the_place(name, tmp_path, capfd):
    content, words = malformed.MALFORMED[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError) as caught:
        load(path)
    message = str(caught.value)
    for word in (name, *words):
        assert word in message
    assert caught.value.hint, "a refusal says what to do next"
    assert "\n" not in message
    assert "Traceback" not in message
    assert message.isprintable()
    assert capfd.readouterr() == ("", ""), "nothing is printed besides"


def test_a_missing_file_a_folder_and_a_device_are_refused(tmp_path):
    for path, words in (
        (tmp_path / "nowhere.obj", "There is no file"),
        (tmp_path, "is a folder"),
        (os.devnull, "not an ordinary file"),
        ("no\0name.obj", "cannot be read"),
        (None, "cannot be read"),
    ):
        with pytest.raises(MeshError, match=words):
            load(path)


def test_a_message_shows_the_path_from_the_working_folder(tmp_path, monkeypatch):
    (tmp_path / "cloth").mkdir()
    (tmp_path / "cloth" / "bad.obj").write_bytes(b"v 0\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MeshError, match=r"^cloth/bad\.obj, line 1"):
        load("cloth/bad.obj")


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".vtk", ".vtu", ".msh"])
def test_any_beginning_of_a_lawful_file_loads_or_is_refused(suffix, tmp_path):
    whole = tmp_path / f"whole{suffix}"
    mesh = grid(3, 3)
    if suffix == ".msh":
        import meshio

        meshio.Mesh(mesh.vertices, [("triangle", mesh.triangles)]).write(
            whole, file_format="gmsh22", binary=False
        )
    else:
        save(mesh, whole)
    content = whole.read_bytes()
    part = tmp_path / f"part{suffix}"
    for end in range(1, len(content), max(1, len(content) // 40)):
        part.write_bytes(content[:end])
        try:
            found = load(part)
        except MeshError:
            continue
        check(found)
        assert suffix == ".obj" or np.allclose(found.vertices, mesh.vertices), (
            "only OBJ does not say its length"
        )


@settings(max_examples=60, deadline=None)
@given(
    suffix=st.sampled_from([".obj", ".off", ".ply", ".stl", ".vtk", ".vtu", ".msh"]),
    head=st.sampled_from(
        [b"", b"OFF\n", b"ply\n", b"solid\n", b"# vtk DataFile Version 3.0\n\n", b"$MeshFormat\n"]
    ),
    junk=st.binary(max_size=300),
)
def test_a_file_of_junk_never_raises_anything_but_a_mesh_error(suffix, head, junk, tmp_path_factory):
    path = tmp_path_factory.mktemp("junk") / f"junk{suffix}"
    path.write_bytes(head + junk)
    with pytest.raises(MeshError):
        load(path)


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
TWO = [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        ([], [], "no vertices"),
        (SQUARE, [], "no triangles"),
        (SQUARE, [[0, 1]], "shape (1, 2)"),
        (SQUARE, [0, 1, 2], "shape (3,)"),
        ([0.0, 1.0, 2.0], TWO, "shape (3,)"),
        ([[0, 0, 0, 0]], TWO, "shape (1, 4)"),
        ([[0, 0, 0], [1, 0]], TWO, "not an array of numbers"),
        ("abc", TWO, "not an array of numbers"),
        (None, TWO, "shape ()"),
        (np.array(SQUARE) * 1j, TWO, "not an array of numbers"),
        (np.array([["0", "0", "0"]]), TWO, "not an array of numbers"),
        (SQUARE, [[0, 1, 2.5]], "whole numbers"),
        (SQUARE, [[0, 1, np.nan]], "not finite"),
        (SQUARE, [[0, 1, 10**400]], "not vertex numbers"),
        (SQUARE, np.ones((1, 3), dtype=bool), "not vertex numbers"),
        (SQUARE, [[0, 1, "x"]], "not vertex numbers"),
        (SQUARE, np.array([[0, 1, 2**64 - 1]], dtype=np.uint64), "vertex 18446744073709551615"),
        (SQUARE, [[0, 1, -1]], "vertex -1"),
        (SQUARE, [[0, 1, 4], [0, 2, 3]], "triangle 0 (counting from 0), which asks for vertex 4"),
        (SQUARE, [[0, 1, 1], [0, 2, 3]], "same vertex twice"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "degenerate"),
        ([[0, 0, 0], [0, 0, 0], [0, 0, 0]], [[0, 1, 2]], "degenerate"),
        ([[0, 0, 0], [1e-200, 0, 0], [0, 1e-200, 0]], [[0, 1, 2]], "degenerate"),
        ([[0, 0, 0], [1e200, 0, 0], [0, 1e200, 0]], [[0, 1, 2]], "farther out"),
        ([[0, 0, 0], [1, 0, np.inf], [0, 1, 0]], [[0, 1, 2]], "not finite"),
        (SQUARE, [[0, 1, 2], [0, 2, 3], [2, 0, 1]], "duplicate"),
        (SQUARE, [[0, 1, 2], [0, 3, 2]], "inconsistent winding"),
        ([*SQUARE, [0, 0, 1]], [*TWO, [2, 0, 4]], "non-manifold"),
        ([*SQUARE, [0, 0, 1]], TWO, "vertex 4 (counting from 0)"),
    ],
)
def test_arrays_that_are_no_cloth_are_refused(vertices, triangles, words):
    with pytest.raises(MeshError) as caught:
        Mesh.from_arrays(vertices, triangles, name="towel")
    assert words in str(caught.value)
    assert "'towel'" in str(caught.value)
    assert caught.value.hint


def test_a_mesh_built_by_hand_is_checked_like_any_other():
    check(grid(3, 3))
    with pytest.raises(MeshError, match="inconsistent winding"):
        check(Mesh(np.array(SQUARE, dtype=float), np.array([[0, 1, 2], [0, 3, 2]], dtype=np.int32)))


ANYTHING = st.one_of(
    st.none(),
    st.text(max_size=5),
    st.integers(),
    st.lists(
        st.lists(st.one_of(st.integers(-3, 6), st.floats(), st.text(max_size=2), st.none()), max_size=4)
    ),
    hnp.arrays(
        st.sampled_from(
            [np.float64, np.float32, np.int64, np.uint8, np.uint64, np.bool_, np.complex128, object]
        ),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5),
    ),
)
CLOSE = st.one_of(
    ANYTHING,
    hnp.arrays(np.float64, st.tuples(st.integers(0, 8), st.integers(2, 3))),
    hnp.arrays(np.int64, st.tuples(st.integers(0, 8), st.just(3)), elements=st.integers(-1, 8)),
)


@settings(max_examples=300, deadline=None)
@given(vertices=CLOSE, triangles=CLOSE)
def test_junk_arrays_never_raise_anything_but_a_mesh_error(vertices, triangles):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            mesh = Mesh.from_arrays(vertices, triangles)
        except MeshError:
            return
    assert mesh.vertices.shape == (len(mesh.vertices), 3)
    assert np.isfinite(mesh.vertices).all()


class _Vexing:
    def __array__(self, *_, **__):
        raise RuntimeError("not today")


def test_an_object_that_raises_on_conversion_is_refused():
    with pytest.raises(MeshError, match="not today"):
        Mesh.from_arrays(_Vexing(), [[0, 1, 2]])
    with pytest.raises(MeshError, match="not today"):
        Mesh.from_arrays(SQUARE, _Vexing())


@pytest.mark.parametrize("name", ["cloth.xyz", "cloth.msh", "cloth"])
def test_saving_in_an_unknown_format_names_the_known_ones(name, tmp_path):
    with pytest.raises(MeshError, match=r"\.obj, \.off, \.ply, \.stl, \.vtk, \.vtu"):
        save(grid(2, 2), tmp_path / name)


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".vtk", ".vtu"])
def test_saving_into_a_missing_folder_is_refused(suffix, tmp_path):
    with pytest.raises(MeshError, match="could not be written"):
        save(grid(2, 2), tmp_path / "nowhere" / f"cloth{suffix}")
