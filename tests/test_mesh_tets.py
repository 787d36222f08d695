"""Tetrahedral meshes: what is loaded is the solid that was saved, and what cannot be one is refused by name."""

import numpy as np
import pytest

import muslin
from muslin import mesh
from muslin.base.errors import MeshError
from muslin.mesh import TetMesh, ball, block, load_any, load_tets

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], float)


def medit(solid, extra=""):
    points = "\n".join(f"{x!r} {y!r} {z!r} 0" for x, y, z in solid.vertices.tolist())
    cells = "\n".join(" ".join(map(str, row)) + " 7" for row in (solid.cells + 1).tolist())
    return (
        f"MeshVersionFormatted 2\nDimension\n3\n# a comment\nVertices\n{len(solid.vertices)}\n{points}\n"
        f"{extra}Tetrahedra\n{len(solid.cells)}\n{cells}\nEnd\n"
    )


def tetgen(solid, base):
    points = "\n".join(
        f"{k + base} {x!r} {y!r} {z!r} 1" for k, (x, y, z) in enumerate(solid.vertices.tolist())
    )
    cells = "\n".join(
        f"{k + base} " + " ".join(map(str, row)) for k, row in enumerate((solid.cells + base).tolist())
    )
    node = f"# vertices\n{len(solid.vertices)} 3 0 1\n{points}\n"
    return node, f"{len(solid.cells)} 4 0\n{cells}\n# the end\n"


def write(solid, path):
    if path.suffix == ".mesh":
        path.write_text(medit(solid))
    elif path.suffix in (".node", ".ele"):
        for suffix, text in zip((".node", ".ele"), tetgen(solid, 1), strict=True):
            path.with_suffix(suffix).write_text(text)
    else:
        import meshio

        form = {".msh": "gmsh22", ".vtk": "vtk", ".vtu": "vtu"}[path.suffix]
        meshio.write(
            path,
            meshio.Mesh(solid.vertices, [("tetra", solid.cells)]),
            file_format=form,
            binary=path.suffix == ".vtu",
        )


def flux(solid):
    """Integral of x . n / 3 over the surface: the volume inside, by the divergence theorem."""
    a, b, c = np.moveaxis(solid.vertices[solid.surface], 1, 0)
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6


@pytest.mark.parametrize(("solid", "volume"), [(block(3, 4, 5, 1, 2, 3), 6.0), (ball(9, 2.0), None)])
def test_the_surface_of_a_solid_is_closed_and_turned_outwards(solid, volume):
    assert (solid.volumes > 0).all()
    assert flux(solid) == pytest.approx(solid.volumes.sum(), rel=1e-12)
    if volume is None:  # inscribed, and nearly round
        assert 0.9 < solid.volumes.sum() / (4 / 3 * np.pi * 8) < 1
    else:
        assert solid.volumes.sum() == pytest.approx(volume, rel=1e-12)
    shell = solid.shell()
    mesh.check(shell)
    assert len(mesh.boundary(shell.triangles)) == 0
    edges = len(mesh.edges(shell.triangles))
    assert len(shell.vertices) - edges + len(shell.triangles) == 2, "Euler's number of a sphere"
    np.testing.assert_array_equal(solid.vertices[shell.numbers], shell.vertices)
    # and of the solid itself: vertices - edges + faces - cells of a ball are 1
    inner = {tuple(sorted(face)) for cell in solid.cells.tolist() for face in _faces(cell)}
    lines = {tuple(sorted((a, b))) for face in inner for a in face for b in face if a < b}
    assert len(solid.vertices) - len(lines) + len(inner) - len(solid.cells) == 1


def _faces(cell):
    return [cell[:k] + cell[k + 1 :] for k in range(4)]


@pytest.mark.parametrize("suffix", [".mesh", ".node", ".ele", ".msh", ".vtk", ".vtu"])
def test_a_solid_comes_back_as_it_was_saved(suffix, tmp_path):
    solid = ball(5, 0.5)
    path = tmp_path / f"ball{suffix}"
    write(solid, path)
    found = load_tets(path)
    np.testing.assert_allclose(found.vertices, solid.vertices, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(found.cells, solid.cells)
    assert (found.name, found.notices) == ("ball", ())
    assert isinstance(load_any(path), TetMesh)


def test_tetgen_may_count_from_zero(tmp_path):
    solid = block(2, 2, 3)
    for suffix, text in zip((".node", ".ele"), tetgen(solid, 0), strict=True):
        (tmp_path / f"a{suffix}").write_text(text)
    np.testing.assert_array_equal(load_tets(tmp_path / "a.node").cells, solid.cells)


def test_half_of_a_tetgen_mesh_asks_for_the_other(tmp_path):
    (tmp_path / "a.node").write_text(tetgen(block(2, 2, 2), 1)[0])
    with pytest.raises(MeshError, match=r"a\.ele, with its tetrahedra, is not beside it"):
        load_tets(tmp_path / "a.node")


def test_triangles_of_a_boundary_and_loose_vertices_are_left_out_with_a_word(tmp_path):
    solid = block(2, 2, 2)
    loose = TetMesh(np.concatenate([[[9.0, 9, 9]], solid.vertices]), solid.cells + 1)
    (tmp_path / "a.mesh").write_text(medit(loose, "Triangles\n1\n2 3 4 0\nCorners\n2\n1\n2\n"))
    found = load_tets(tmp_path / "a.mesh")
    np.testing.assert_array_equal(found.cells, solid.cells)
    np.testing.assert_array_equal(found.numbers, np.arange(1, 9))
    assert [n.split(": ")[1] for n in found.notices] == [
        "1 face element left out.",
        "1 vertex in no tetrahedron left out.",
    ]


def test_left_handed_files_are_turned(tmp_path):
    solid = block(2, 3, 2)
    (tmp_path / "a.mesh").write_text(medit(TetMesh(solid.vertices, solid.cells[:, [1, 0, 2, 3]])))
    found = load_tets(tmp_path / "a.mesh")
    np.testing.assert_allclose(np.sort(found.volumes), np.sort(solid.volumes))
    assert "left-handed" in found.notices[0]


REFUSED = {
    "no tetrahedra": (CORNERS, np.zeros((0, 4), int), "has no tetrahedra"),
    "no vertices": (np.zeros((0, 3)), [[0, 1, 2, 3]], "has no vertices"),
    "not finite": (np.where(CORNERS == 1, np.nan, CORNERS), [[0, 1, 2, 3]], "not finite.*vertex 1"),
    "out of range": (CORNERS, [[0, 1, 2, 3], [1, 2, 3, 5]], "tetrahedron 1 .*asks for vertex 5"),
    "negative index": (CORNERS, [[0, 1, 2, -1]], "asks for vertex -1"),
    "a vertex twice": (CORNERS, [[0, 1, 2, 3], [1, 2, 2, 4]], "using the same vertex twice.*tetrahedron 1"),
    "flat": (CORNERS * (1, 1, 1e-9), [[0, 1, 2, 3]], r"\(almost\) no volume.*tetrahedron 0"),
    "inverted": (CORNERS, [[0, 1, 2, 3], [1, 2, 4, 3]], "inverted.*tetrahedron 1"),
    "duplicate": (
        CORNERS, [[0, 1, 2, 3], [1, 2, 0, 3], [1, 2, 3, 4]],
        "duplicate.*tetrahedron 1.*same as tetrahedron 0"),
    "unused": (CORNERS, [[0, 1, 2, 3]], "1 vertex is unused.*vertex 4"),
    "three at a face": (
        [*CORNERS, [0.4, 0.4, 0.5]],
        [[0, 1, 2, 3], [1, 2, 3, 4], [1, 2, 3, 5]],
        "shared by more than two tetrahedra.*vertices 1, 2, 3",
    ),
    "folded over": ([*CORNERS[:4], [0.1, 0.1, 2]], [[0, 1, 2, 3], [0, 1, 2, 4]], "on the same side.*vertices 0, 1, 2"),
    "touching at an edge": (
        [*CORNERS[:4], [0, -1, 0], [0, 0, -1]],
        [[0, 1, 2, 3], [0, 1, 4, 5]],
        "surface is non-manifold at 1 edge; it is the edge from vertex 0 .*to vertex 1",
    ),
    "three corners": (CORNERS, [[0, 1, 2]], "tetrahedra have shape"),
    "halves": (CORNERS, [[0, 1, 2, 3.5]], "not whole numbers"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_a_solid_is_refused_by_name(case):
    vertices, cells, words = REFUSED[case]
    with pytest.raises(MeshError, match=words):
        muslin.TetMesh.from_arrays(vertices, cells)


BROKEN = {
    "cut short": (lambda text: text[: text.index("Tetrahedra") + 40], "promises|ends where"),
    "a word for a number": (lambda text: text.replace("Tetrahedra\n6\n1 ", "Tetrahedra\n6\nx "), "x where a number"),
    "an index too large": (
        lambda text: text.replace("Tetrahedra\n6\n1 ", "Tetrahedra\n6\n99 "),
        r"line \d+\), which asks for vertex 99"),
    "binary": (lambda text: "\0\1" + text, "binary"),
    "of another kind": (lambda text: "solid x\n", "does not begin with MeshVersionFormatted"),
    "no solid": (
        lambda text: text.split("Tetrahedra")[0] + "Triangles\n1\n1 2 3 0\n",
        "has no tetrahedra, only 1 face element"),
    "too many promised": (lambda text: text.replace("Vertices\n8", "Vertices\n800000000"), "promises 800000000"),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_file_is_told_by_its_name_and_line(case, tmp_path):
    change, words = BROKEN[case]
    (tmp_path / "a.mesh").write_text(change(medit(block(2, 2, 2))))
    with pytest.raises(MeshError, match=words) as caught:
        load_tets(tmp_path / "a.mesh")
    assert "a.mesh" in str(caught.value)


def test_cloth_of_a_solid_says_what_is_wanted(tmp_path):
    write(block(2, 2, 2), tmp_path / "a.mesh")
    with pytest.raises(MeshError, match="cloth is a surface of triangles"):
        mesh.load(tmp_path / "a.mesh")


def test_a_solid_scales():
    solid = block(2, 2, 2).scaled(3.0)
    assert (solid.volumes.sum(), solid.scale, solid.extent) == (pytest.approx(27.0), 3.0, 3.0)


@pytest.mark.parametrize("suffix", [".mesh", ".node", ".ele", ".msh", ".vtk"])
def test_a_file_with_a_few_wrong_bytes_is_refused_or_is_still_a_solid(suffix, tmp_path):
    draw = np.random.default_rng(5)
    path = tmp_path / f"a{suffix}"
    write(block(2, 2, 2), path)
    whole = path.read_bytes()
    outcomes = set()
    for _ in range(60):
        content = bytearray(whole[: draw.integers(1, len(whole))] if draw.random() < 0.2 else whole)
        for at in draw.integers(0, len(content), draw.integers(0, 3)):
            content[at] = draw.choice(list(b"0123456789 -.\nxe\x00\xff"))
        path.write_bytes(content)
        try:
            outcomes.add(bool((load_tets(path).volumes > 0).all()))
        except MeshError as error:
            outcomes.add("refused" if len(str(error)) < 600 else str(error))
    assert outcomes == {True, "refused"}


@pytest.mark.parametrize(
    ("made", "name", "expected"),
    [
        (
            lambda path: write(block(2, 2, 2, 1, 2, 3), path),
            "brick.mesh",
            [
                "a solid of 8 vertices and 6 tetrahedra",
                "volume: 6 m^3",
                "12 triangles, 22 m^2",
                "edges: 19, 1 to 3.74",
            ],
        ),
        (
            lambda path: mesh.save(mesh.grid(3, 3), path),
            "sheet.obj",
            [
                "a surface of 9 vertices and 8 triangles, 8 vertices on its boundary",
                "area: 1 m^2",
                "edges: 16, 0.5 to",
            ],
        ),
    ],
)
def test_the_command_says_what_a_mesh_is(made, name, expected, tmp_path, monkeypatch, capsys):
    from muslin import cli

    made(tmp_path / name)
    monkeypatch.setattr("sys.argv", ["muslin", "mesh", str(tmp_path / name)])
    cli.main()
    said = capsys.readouterr().out
    for words in expected:
        assert words in said


def test_the_command_knows_muslins_meshes_by_their_names(tmp_path, monkeypatch, capsys):
    from muslin import cli

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["muslin", "mesh", "course-square"])
    cli.main()
    assert capsys.readouterr().out.startswith("course-square: a surface of ")


def test_the_command_refuses_what_is_no_mesh(tmp_path, monkeypatch, capsys):
    from muslin import cli

    (tmp_path / "a.ele").write_text("1 4 0\n1 1 2 3 4\n")
    monkeypatch.setattr("sys.argv", ["muslin", "mesh", str(tmp_path / "a.ele")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 1
    assert "a.node, with its vertices, is not beside it" in capsys.readouterr().err
