"""Files for other programs: what is written is valid, and is what was given."""

import json
import re
import struct
import xml.etree.ElementTree as ET
from dataclasses import replace

import meshio
import numpy as np
import pytest

from muslin.base.errors import MuslinError
from muslin.export import FORMATS, MAX_FRAMES, Animation, Prop, Shape, write
from muslin.render.materials import linear
from muslin.render.stage import texture_coordinates

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def sheet(n=7, side=2.0):
    s = np.linspace(0, side, n)
    x, z = (a.ravel() for a in np.meshgrid(s, s, indexing="ij"))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = (i[p, q].ravel() for p in (slice(-1), slice(1, None)) for q in (slice(-1), slice(1, None)))
    return np.stack([x, 0 * x, z], axis=1), np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])


class Waves:
    """Frames made when asked for, and a record of the asking."""

    def __init__(self, rest, times):
        self.rest, self.times, self.asked = rest, times, []

    def __len__(self):
        return len(self.times)

    def __getitem__(self, k):
        self.asked.append(k)
        x = self.rest.copy()
        x[:, 1] += 0.3 * np.sin(3 * x[:, 0] + 20 * self.times[k]) - self.times[k]
        return x


def animation(k=6, dt=1 / 60, props=True, strain=True, name="drape"):
    rest, triangles = sheet()
    times = np.arange(k) * dt
    corners = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1.0]])
    still = Prop("ball", TETRAHEDRON, corners)
    moving = Prop("ball", TETRAHEDRON, [0.1 * corners + [t, 2, 0] for t in times], colour="#ff0000")
    return Animation(
        times,
        Waves(rest, times),
        triangles,
        rest,
        name,
        (still, moving) if props else (),
        strain=(lambda k: np.full(len(rest), 1.0 + k)) if strain else None,
    )


# --- GLB ---------------------------------------------------------------------------------------------------


def chunks(path):
    data = path.read_bytes()
    magic, version, total = struct.unpack_from("<4sII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    assert total % 4 == 0
    length, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    assert length % 4 == 0
    document = json.loads(data[20 : 20 + length])
    size, kind = struct.unpack_from("<I4s", data, 20 + length)
    assert kind == b"BIN\0"
    assert 28 + length + size == total
    return document, data[28 + length :]


def decode(document, binary, accessor):
    a = document["accessors"][accessor]
    view = document["bufferViews"][a["bufferView"]]
    dtype = {5126: "<f4", 5125: "<u4"}[a["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
    assert a["count"] * width * 4 == view["byteLength"]
    assert view["byteOffset"] % 4 == 0
    values = np.frombuffer(binary, dtype, a["count"] * width, view["byteOffset"]).reshape(-1, width)
    if "min" in a:
        np.testing.assert_array_equal(values.min(axis=0), np.array(a["min"], dtype="f4"))
        np.testing.assert_array_equal(values.max(axis=0), np.array(a["max"], dtype="f4"))
    return values


def test_glb_obeys_the_rules_of_gltf(tmp_path):
    document, binary = chunks(write(animation(), tmp_path / "drape", "glb")[0])
    assert document["asset"]["version"] == "2.0"
    assert document["buffers"] == [{"byteLength": len(binary)}]
    ends = [v["byteOffset"] + v["byteLength"] for v in document["bufferViews"]]
    assert max(ends) == len(binary)
    assert [v["byteOffset"] for v in document["bufferViews"][1:]] == ends[:-1]
    for i in range(len(document["accessors"])):
        assert np.isfinite(decode(document, binary, i)).all()
    assert all(m["doubleSided"] for m in document["materials"])
    for mesh in document["meshes"]:
        (primitive,) = mesh["primitives"]
        attributes = primitive["attributes"]
        counts = {document["accessors"][a]["count"] for a in attributes.values()}
        assert len(counts) == 1
        assert "min" in document["accessors"][attributes["POSITION"]]
        views = [document["accessors"][a]["bufferView"] for a in attributes.values()]
        assert {document["bufferViews"][v]["target"] for v in views} == {34962}
        index = document["accessors"][primitive["indices"]]
        assert document["bufferViews"][index["bufferView"]]["target"] == 34963
        indices = decode(document, binary, primitive["indices"])
        assert indices.max() < counts.pop()
        lengths = np.linalg.norm(decode(document, binary, attributes["NORMAL"]), axis=1)
        np.testing.assert_allclose(lengths, 1, atol=1e-6)
        for target in primitive.get("targets", []):
            assert document["accessors"][target["POSITION"]]["count"] == len(lengths)
            assert "min" in document["accessors"][target["POSITION"]]


def test_glb_frame_k_is_the_base_plus_the_target_its_weights_select(tmp_path):
    given = animation(k=6)
    document, binary = chunks(write(given, tmp_path / "drape.glb", "glb")[0])
    (clip,) = document["animations"]
    (sampler,) = clip["samplers"]
    times = decode(document, binary, sampler["input"]).ravel()
    np.testing.assert_allclose(times, given.times, rtol=1e-6)
    assert sampler["interpolation"] == "LINEAR"
    moved = {c["target"]["node"] for c in clip["channels"]}
    assert moved == {0, 2}  # the cloth and the moving ball
    for node, body in ((0, given), (2, given.props[1])):
        (primitive,) = document["meshes"][document["nodes"][node]["mesh"]]["primitives"]
        targets = primitive["targets"]
        weights = decode(document, binary, sampler["output"]).reshape(len(times), len(targets))
        base = decode(document, binary, primitive["attributes"]["POSITION"])
        deltas = np.stack([decode(document, binary, t["POSITION"]) for t in targets])
        for k in range(6):
            x = base + np.tensordot(weights[k], deltas, axes=1)
            np.testing.assert_allclose(x, body.at(k), atol=1e-6)
    still = document["meshes"][1]
    assert "targets" not in still["primitives"][0]
    assert "weights" not in still


def test_glb_of_a_long_run_keeps_a_bounded_number_of_frames_and_says_so(tmp_path):
    heard = []
    given = animation(k=50)
    (file,) = write(given, tmp_path / "long", "glb", notice=heard.append, max_frames=10)
    document, binary = chunks(file)
    assert len(document["meshes"][0]["primitives"][0]["targets"]) == 9
    times = decode(document, binary, document["animations"][0]["samplers"][0]["input"]).ravel()
    assert times[0] == 0
    assert times[-1] == np.float32(given.times[-1])
    assert np.ptp(np.diff(times)) < 1.5 / 60
    assert len(heard) == 1
    assert "10 of 50 frames" in heard[0]


def test_glb_keeps_what_viewers_can_hold_unless_told_otherwise(tmp_path):
    given = animation(k=MAX_FRAMES + 1, props=False)
    for options, kept in (({}, MAX_FRAMES), ({"max_frames": 1000}, MAX_FRAMES + 1)):
        document, _ = chunks(write(given, tmp_path / "long", "glb", notice=lambda _: None, **options)[0])
        assert len(document["meshes"][0]["primitives"][0]["targets"]) == kept - 1


def test_glb_of_one_frame_is_a_plain_mesh(tmp_path):
    document, _ = chunks(write(animation(k=1, props=False), tmp_path / "still", "glb")[0])
    assert "animations" not in document
    assert "targets" not in document["meshes"][0]["primitives"][0]


def test_glb_opens_in_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    given = animation()
    scene = trimesh.load_scene(write(given, tmp_path / "drape", "glb")[0])
    assert len(scene.geometry) == 3
    np.testing.assert_allclose(scene.geometry["drape"].vertices, given.at(0), atol=1e-6)


def test_glb_normals_of_collapsed_triangles_are_still_unit_vectors(tmp_path):
    rest, triangles = sheet(3)
    document, binary = chunks(
        write(Animation([0.0], [0 * rest], triangles, rest), tmp_path / "point", "glb")[0]
    )
    normals = decode(document, binary, document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"])
    np.testing.assert_array_equal(normals, np.tile([0, 1, 0], (len(rest), 1)))


# --- USDA --------------------------------------------------------------------------------------------------


def test_usda_samples_every_frame_at_a_whole_time_code(tmp_path):
    given = animation(k=4)
    text = write(given, tmp_path / "drape", "usda")[0].read_text()
    assert text.startswith("#usda 1.0\n")
    for line in (
        'upAxis = "Y"',
        "metersPerUnit = 1\n",
        "timeCodesPerSecond = 60\n",
        "startTimeCode = 0\n",
        "endTimeCode = 3\n",
    ):
        assert line in text
    assert text.count("(") == text.count(")")
    assert text.count("{") == text.count("}")
    cloth = text[text.index('def Mesh "drape"') : text.index('def Mesh "ball"')]
    samples = cloth[cloth.index("points.timeSamples") :].splitlines()[1:5]
    for k, line in enumerate(samples):
        code, values = line.split(":", 1)
        assert int(code) == k
        x = np.array(re.findall(r"[-+.\de]+", values), dtype=float).reshape(-1, 3)
        np.testing.assert_array_equal(x.astype(np.float32), given.at(k).astype(np.float32))
    assert "primvars:strain.timeSamples" in cloth


def test_usda_says_the_same_to_openusd(tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    given = animation(k=5, dt=0.03)
    stage = Usd.Stage.Open(str(write(given, tmp_path / "drape", "usda")[0]))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    root = stage.GetDefaultPrim().GetPath()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{root}/drape"))
    for k, t in enumerate(given.times):
        code = t * stage.GetTimeCodesPerSecond()
        np.testing.assert_allclose(np.array(mesh.GetPointsAttr().Get(code)), given.at(k), atol=1e-6)
        low, high = np.array(mesh.GetExtentAttr().Get(code))
        np.testing.assert_allclose([low, high], [given.at(k).min(axis=0), given.at(k).max(axis=0)], atol=1e-6)
    triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    np.testing.assert_array_equal(triangles, given.triangles)
    assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
    assert len(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get()) == len(given.rest)
    still = UsdGeom.Mesh(stage.GetPrimAtPath(f"{root}/ball"))
    assert still.GetPointsAttr().GetNumTimeSamples() == 0
    assert UsdGeom.Mesh(stage.GetPrimAtPath(f"{root}/ball_2")).GetPointsAttr().GetNumTimeSamples() == 5


def samples_of(prim, attribute):
    """Time samples of a USDA attribute, code -> numbers."""
    begin = prim.index(f"{attribute}.timeSamples = {{")
    lines = prim[begin : prim.index("        }\n", begin)].splitlines()[1:]
    pairs = (line.strip().rstrip(",").split(": ", 1) for line in lines)
    return {float(code): np.array(re.findall(r"[-+.\de]+", text), dtype=float) for code, text in pairs}


def adapting(k=5, changes=(0, 2, 3)):
    """Frames of a cloth whose mesh changes in some, and the animation of it."""
    given, sizes = animation(k=k, strain=False), {}
    for frame in range(k):
        sizes[frame] = 3 + 2 * max(i for i, change in enumerate(changes) if change <= frame)

    def shape(frame):
        rest, triangles = sheet(sizes[frame])
        return Shape(
            rest + np.array([0.0, 0.1 * frame, 0.0]), rest, triangles, np.arange(len(rest)) + 0.5 * frame
        )

    return replace(given, adapted=shape), shape


def test_usda_of_an_adaptive_cloth_has_the_mesh_of_each_frame(tmp_path):
    given, shape = adapting()
    text = write(given, tmp_path / "drape", "usda")[0].read_text()
    assert text.count("{") == text.count("}")
    cloth = text[text.index('def Mesh "drape"') : text.index('def Mesh "ball"')]
    points, corners, counts, normals, st, strain = (
        samples_of(cloth, name)
        for name in (
            "points", "faceVertexIndices", "faceVertexCounts", "normals", "primvars:st", "primvars:strain",
        )
    )  # fmt: skip
    assert list(corners) == list(counts) == [0, 2, 3]
    assert list(points) == list(normals) == list(st) == list(strain) == [0, 1, 2, 3, 4]
    for k in range(5):
        wanted, held = shape(k), max(code for code in corners if code <= k)
        assert np.array_equal(corners[held].reshape(-1, 3), wanted.triangles)
        assert np.array_equal(counts[held], np.full(len(wanted.triangles), 3))
        assert np.array_equal(points[k].reshape(-1, 3).astype(np.float32), wanted.x.astype(np.float32))
        assert np.array_equal(strain[k], wanted.strain)
        assert len(normals[k]) == len(points[k]) == len(st[k]) // 2 * 3
    assert "faceVertexIndices = " in text[text.index('def Mesh "ball"') :]  # what stays has no samples


def test_usda_of_an_adaptive_cloth_says_the_same_to_openusd(tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    given, shape = adapting()
    stage = Usd.Stage.Open(str(write(given, tmp_path / "drape", "usda")[0]))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{stage.GetDefaultPrim().GetPath()}/drape"))
    for k in range(5):
        code, wanted = Usd.TimeCode(k), shape(k)
        triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get(code)).reshape(-1, 3)
        np.testing.assert_array_equal(triangles, wanted.triangles)
        np.testing.assert_allclose(np.array(mesh.GetPointsAttr().Get(code)), wanted.x, atol=1e-6)
        assert UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(code), mesh.GetFaceVertexCountsAttr().Get(code), len(wanted.x)
        )[0]
        assert len(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get(code)) == len(wanted.x)


def test_usda_of_uneven_times_keeps_the_times(tmp_path):
    rest, triangles = sheet(3)
    given = Animation([0.0, 0.1, 0.25, 0.35], [rest] * 4, triangles, rest)
    text = write(given, tmp_path / "uneven", "usda")[0].read_text()
    rate = float(re.search(r"timeCodesPerSecond = (.*)", text)[1])
    block = text[text.index("points.timeSamples") :].split("}")[0]
    codes = [float(c) for c in re.findall(r"^\s*([\d.]+):", block, re.M)]
    np.testing.assert_allclose(np.array(codes) / rate, given.times, atol=1e-12)


# --- one file per frame ------------------------------------------------------------------------------------


@pytest.mark.parametrize("to", ["pvd", "vtu"])
def test_pvd_lists_each_frame_at_its_time_with_exact_data(tmp_path, to):
    given = animation(k=4)
    files = write(given, tmp_path / "drape", to)
    assert files[0] == tmp_path / "drape.pvd"
    assert all(f.is_file() for f in files)
    sets = ET.parse(files[0]).getroot().findall("./Collection/DataSet")
    cloth = [s for s in sets if s.get("name") == "drape"]
    np.testing.assert_array_equal([float(s.get("timestep")) for s in cloth], given.times)
    for k, entry in enumerate(cloth):
        mesh = meshio.read(tmp_path / entry.get("file"))
        np.testing.assert_allclose(mesh.points, given.at(k), atol=1e-12)
        np.testing.assert_array_equal(mesh.cells_dict["triangle"], given.triangles)
        np.testing.assert_allclose(mesh.point_data["displacement"], given.at(k) - given.rest, atol=1e-12)
        np.testing.assert_array_equal(mesh.point_data["stretch"], 1.0 + k)
    assert len({s.get("file") for s in sets if s.get("name") == "ball"}) == 1
    moving = [s.get("file") for s in sets if s.get("name") == "ball_2"]
    for k, file in enumerate(moving):
        np.testing.assert_allclose(meshio.read(tmp_path / file).points, given.props[1].at(k), atol=1e-12)


def test_ply_and_obj_frames_read_back_exactly(tmp_path):
    given = animation(k=3)
    plys = write(given, tmp_path / "drape", "ply")
    assert [f.name for f in plys[:4]] == [
        "drape_0000.ply",
        "drape_0001.ply",
        "drape_0002.ply",
        "drape_ball_0000.ply",
    ]
    objs = write(given, tmp_path / "drape", "obj")
    assert [f.name for f in objs] == ["drape_0000.obj", "drape_0001.obj", "drape_0002.obj"]
    n, m = len(given.rest), len(given.triangles)
    for k in range(3):
        ply = meshio.read(plys[k])
        np.testing.assert_array_equal(ply.points, given.at(k))
        np.testing.assert_array_equal(ply.cells_dict["triangle"], given.triangles)
        np.testing.assert_array_equal(ply.point_data["stretch"], 1.0 + k)
        lines = objs[k].read_text().splitlines()
        v = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
        np.testing.assert_array_equal(v[:n], given.at(k))
        np.testing.assert_array_equal(v[n + 4 :], given.props[1].at(k))
        f = [[int(c.split("/")[0]) - 1 for c in s.split()[1:]] for s in lines if s.startswith("f ")]
        np.testing.assert_array_equal(f[:m], given.triangles)
        np.testing.assert_array_equal(f[m + 4 :], TETRAHEDRON + n + 4)
        assert [line for line in lines if line.startswith("o ")] == ["o drape", "o ball", "o ball_2"]


def test_frames_of_an_older_longer_series_are_pointed_out(tmp_path):
    write(animation(k=5, name="run"), f"{tmp_path}/", "ply")
    (tmp_path / "run_other_0000.ply").touch()
    heard = []
    write(animation(k=3, name="run"), tmp_path, "ply", notice=heard.append)
    assert len(heard) == 1
    assert heard[0].startswith("4 files")  # two of the cloth, two of the moving ball
    write(animation(k=5, name="run"), tmp_path, "ply", notice=heard.append)
    assert len(heard) == 1


# --- all formats -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("to", FORMATS)
def test_frames_are_asked_for_once_and_in_order(tmp_path, to):
    given = animation(k=5)
    write(given, tmp_path / "drape", to)
    assert given.frames.asked == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("to", FORMATS)
def test_the_same_run_is_exported_to_the_same_bytes(tmp_path, to):
    first, second = ([f.read_bytes() for f in write(animation(k=2), tmp_path / d / "a", to)] for d in "ab")
    assert first == second


@pytest.mark.parametrize("to", FORMATS)
def test_the_path_may_be_a_stem_a_file_or_a_folder(tmp_path, to):
    extension = FORMATS[to][1]
    series = to in ("ply", "obj")
    for path, stem in (
        (tmp_path / "a" / "run.1", "run.1"),
        (tmp_path / "b" / f"run{extension}", "run"),
        (tmp_path, "my drape"),
        (f"{tmp_path}/c/", "my drape"),
    ):
        first = write(animation(k=2, props=False, name="my drape"), path, to)[0]
        assert first.name == stem + ("_0000" if series else "") + extension
        assert first.is_file()
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("to", FORMATS)
def test_a_run_that_blew_up_is_refused_with_the_frame_that_did(tmp_path, to):
    rest, triangles = sheet(3)
    bad = rest.copy()
    bad[4, 1] = np.nan
    with pytest.raises(MuslinError, match=r"Vertex 4 of 'cloth' .* in frame 2"):
        write(Animation([0, 1, 2.0], [rest, rest, bad], triangles, rest), tmp_path / "bad", to)
    assert not list(tmp_path.glob("*.part"))
    assert not list(tmp_path.glob("bad.glb"))
    if to == "pvd":  # what was written before can be used
        assert len(ET.parse(tmp_path / "bad.pvd").getroot().findall(".//DataSet")) == 2


def test_an_unknown_format_names_those_that_exist(tmp_path):
    with pytest.raises(MuslinError, match="glb, usda, pvd, vtu, ply, obj"):
        write(animation(), tmp_path / "drape", "fbx")
    with pytest.raises(MuslinError, match="no option max_frames"):
        write(animation(), tmp_path / "drape", "usda", max_frames=3)


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    for to in FORMATS:
        with pytest.raises(MuslinError, match="cannot be written"):
            write(animation(k=2), tmp_path / "file" / "drape", to)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"times": []}, "nothing to export"),
        ({"times": [0.0]}, "2 frames but 1 times"),
        ({"times": [0.0, 0.0]}, "do not increase"),
        ({"times": [-1.0, 0.0]}, "do not increase"),
        ({"triangles": [[0, 1, 9]]}, "names vertex 9"),
        ({"triangles": [[0, 1, -1]]}, "names vertex -1"),
        ({"triangles": [[0.0, 1, 2]]}, "whole numbers"),
        ({"rest": np.zeros((9, 2))}, "shape"),
        ({"colour": "red"}, "not a colour"),
        ({"props": (Prop("ball", TETRAHEDRON, [np.zeros((4, 3))] * 3),)}, "has 3 frames"),
    ],
)
def test_malformed_animations_are_refused(change, message):
    rest, triangles = sheet(3)
    good = {"times": [0.0, 1.0], "frames": [rest, rest], "triangles": triangles, "rest": rest}
    with pytest.raises(MuslinError, match=message):
        Animation(**good | change)


def test_a_frame_of_another_size_is_refused(tmp_path):
    rest, triangles = sheet(3)
    with pytest.raises(MuslinError, match=r"Frame 1 .* instead of \(9, 3\)"):
        write(Animation([0, 1.0], [rest, rest[:8]], triangles, rest), tmp_path / "x", "glb")


@pytest.mark.parametrize("thin", [0, 1, 2])
def test_texture_coordinates_fill_the_pattern_without_mirroring_it(thin):
    flat = np.array([[0, 0], [2.0, 0], [2.0, 1.0], [0, 1.0]])
    rest = np.insert(flat, thin, 0.5, axis=1)
    uv = texture_coordinates(rest)
    assert uv.min() == 0
    assert uv.max() == 1
    # The triangle keeps its turn as seen from the positive end of the thin axis.
    edges = rest[1:3] - rest[0]
    turn = np.cross(*edges)[thin]
    a, b = uv[1] - uv[0], uv[2] - uv[0]
    assert np.sign(a[0] * b[1] - a[1] * b[0]) == np.sign(turn)
    assert np.ptp(uv, axis=0).min() == pytest.approx(0.5)


def test_colours_are_linear_light():
    assert linear("#000000").tolist() == [0, 0, 0]
    assert linear("#ffFFff").tolist() == [1, 1, 1]
    assert linear("#808080")[0] == pytest.approx(0.2159, abs=1e-4)
