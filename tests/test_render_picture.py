"""Pictures show what geometry and optics say, the same bytes every time."""

import dataclasses
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from muslin.base import runtime
from muslin.base.errors import MuslinError
from muslin.mesh import block, shapes, vertex_normals
from muslin.render import (
    Camera,
    Legend,
    Light,
    Material,
    Surface,
    capsule_surface,
    draw,
    fit_camera,
    ground_surface,
    sphere_surface,
    stage,
    strain_colours,
    text_overlay,
    write_png,
)
from muslin.render.lettering import draw_legend
from muslin.render.materials import linear, srgb, strain_position, strain_table
from muslin.render.tables import gather

SIZE = (160, 120)
FLAT = Light(sun_strength=0, sky_strength=0.6, floor_strength=0.6, sky="#ffffff", floor="#ffffff")
"""The same light from everywhere: a surface shows its own colour, darkened to 60%."""


def grid(n, normal="y", size=1.0):
    """A flat square cloth of n x n vertices around the origin, front towards +normal."""
    g = np.linspace(-size / 2, size / 2, n)
    u, v = np.meshgrid(g, g, indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    x = np.zeros((n * n, 3))
    x[:, [2, 0] if normal == "y" else [0, 1]] = uv
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return x, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), uv


def draped(n=24):
    """A cloth with folds over a ball, for pictures that have a bit of everything."""
    x, t, uv = grid(n)
    r = np.hypot(x[:, 0], x[:, 2])
    phi = np.arctan2(x[:, 2], x[:, 0])
    x[:, 1] = 0.6 - 1.4 * r**2 + 0.3 * r**2 * np.cos(8 * phi)
    cloth = Surface(x, t, Material("weave", "#c04a35", back="#dfb48c"), uv=uv)
    return [cloth, sphere_surface((0, 0.3, 0), 0.28), ground_surface(0)], fit_camera(x, margin=0.3, size=SIZE)


def differs(image, background):
    return (np.abs(image.astype(int) - np.asarray(background)) > 3).any(axis=2)


# Normals


def test_a_picture_has_the_normals_of_the_mesh():
    """On a fold askew over a grid, whose rows are cut one way and the other."""
    mesh = shapes.grid(16, 16, plane="xz", diagonals="zigzag")
    along, across = mesh.vertices @ [1, 0, 1], mesh.vertices @ [1, 0, -1]
    x = np.stack(
        [np.sin(6 * along) / 6 + across, np.cos(6 * along) / 6, np.sin(6 * along) / 6 - across], axis=1
    )
    runtime.start()
    from muslin.render import shade

    scene = gather([Surface(x, mesh.triangles, Material("solid", "#a0a0a0"))], wireframe=False)
    seen = scene.vertex[:, shade.NORMAL : shade.NORMAL + 3]
    np.testing.assert_allclose(seen, vertex_normals(x, mesh.triangles), atol=2e-6)


def test_a_solids_sharp_edges_are_sharp_and_its_round_ones_round():
    shell = block(3, 4, 5, 1.0, 2.0, 3.0).shell()
    rows, faces = stage.creased(shell.vertices, shell.triangles)
    np.testing.assert_array_equal(rows[faces], shell.triangles)
    normals = vertex_normals(shell.vertices[rows], faces)
    np.testing.assert_allclose(
        np.sort(np.abs(normals), axis=1), np.tile([0.0, 0.0, 1.0], (len(rows), 1)), atol=1e-15
    )
    assert len(rows) == 2 * (3 * 4 + 4 * 5 + 3 * 5)  # each of six sides has its own
    ball = sphere_surface((0, 0, 0), 1.0)
    rows, faces = stage.creased(np.asarray(ball.vertices), np.asarray(ball.triangles))
    np.testing.assert_array_equal(np.sort(rows), np.arange(len(ball.vertices)))


# Determinism


def test_the_same_scene_gives_the_same_bytes_with_any_number_of_threads():
    script = (
        "import sys, hashlib; sys.path.insert(0, sys.argv[1]);"
        "from test_render_picture import draped, draw, SIZE;"
        "s, c = draped(); h = hashlib.sha256();"
        "[h.update(draw(s, c, SIZE, q).tobytes()) for q in ('draft', 'good', 'good')];"
        "print(h.hexdigest())"
    )
    seen = set()
    for threads in ("1", "2"):
        run = subprocess.run(
            [sys.executable, "-c", script, str(Path(__file__).parent)],
            env={**os.environ, "MUSLIN_THREADS": threads, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        seen.add(run.stdout.split()[-1])
    scene, camera = draped()
    here = hashlib.sha256()
    for quality in ("draft", "good", "good"):
        here.update(draw(scene, camera, SIZE, quality).tobytes())
    assert seen == {here.hexdigest()}


# What is seen


def rays(camera, size):
    """Directions through all pixel centres, (height, width, 3), advancing by 1 along the line of sight."""
    right, up, forward = camera.axes()
    f = camera.focal(size)
    x = (np.arange(size[0]) + 0.5 - size[0] / 2) / f
    y = (size[1] / 2 - np.arange(size[1]) - 0.5) / f
    return x[None, :, None] * right + y[:, None, None] * up + forward


def meets(camera, size, a, b, c):
    """Depth at which the ray of each pixel meets the triangle, inf for none, and how clear-cut that is."""
    d = rays(camera, size)
    m = np.stack([a, b, c], axis=1) - np.asarray(camera.eye)[:, None]
    beta = d @ np.linalg.inv(m).T  # divided by depth
    depth = 1 / beta.sum(axis=2)
    hit = (beta >= 0).all(axis=2) & (depth > camera.near)
    return np.where(hit, depth, np.inf), np.abs(beta).min(axis=2) * np.abs(depth)


@pytest.mark.parametrize("behind", [False, True], ids=["in front", "reaching behind the camera"])
def test_a_triangle_covers_exactly_the_pixels_whose_rays_meet_it(behind):
    camera = Camera(eye=(0, 0.5, 3), target=(0, 0, 0), fov=50)
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(8):
        corners = rng.normal(size=(3, 3)) * 0.8
        if behind:
            corners[0] = [0.3 * rng.normal(), 0.4, 4.5]
        image = draw(
            [Surface(corners, [[0, 1, 2]], Material("solid", "#000000"))],
            camera,
            SIZE,
            "draft",
            background="#ffffff",
        )
        depth, sure = meets(camera, SIZE, *corners)
        clear = sure > 1e-6
        assert (differs(image, 255) == np.isfinite(depth))[clear].all()
        covered += np.isfinite(depth).sum()
    assert covered > 2000


def test_the_nearer_of_two_crossing_triangles_is_seen_at_every_pixel():
    camera = Camera(eye=(0, 0, 3), fov=40)
    one = np.array([[-1.0, -0.8, 0.5], [1, -0.8, -0.5], [0, 0.9, 0]])
    two = one * [-1, 1, 1] + [0.05, 0.1, 0]
    pair = [
        Surface(one, [[0, 1, 2]], Material("solid", "#ff0000")),
        Surface(two, [[0, 1, 2]], Material("solid", "#0000ff")),
    ]
    image = draw(pair, camera, SIZE, "draft", light=FLAT, background="#000000")
    (a, sure_a), (b, sure_b) = meets(camera, SIZE, *one), meets(camera, SIZE, *two)
    with np.errstate(invalid="ignore"):
        clear = (sure_a > 1e-6) & (sure_b > 1e-6) & ~(np.abs(a - b) < 1e-4)
    assert ((image[..., 0] > 50) == (a < b))[clear].all()
    assert ((image[..., 2] > 50) == (b < a))[clear].all()
    assert (a < b).sum() > 1000
    assert (b < a).sum() > 1000


def test_a_spheres_silhouette_has_the_area_of_its_tangent_cone():
    radius, distance, size = 0.5, 3.0, (300, 300)
    camera = Camera(eye=(0, 0, distance), fov=30)
    for quality in ("draft", "good"):
        image = draw(
            [sphere_surface((0, 0, 0), radius, Material("solid", "#000000"))],
            camera,
            size,
            quality,
            background="#ffffff",
        )
        share = 1 - (srgb_to_light(image[..., 0]) - srgb_to_light(image[..., 0].min())) / (
            srgb_to_light(image[..., 0].max()) - srgb_to_light(image[..., 0].min())
        )
        area = np.pi * camera.focal(size) ** 2 * radius**2 / (distance**2 - radius**2)
        assert (share > 0.5).sum() == pytest.approx(area, rel=0.01)


@pytest.mark.parametrize("quality", ["draft", "good", "best"])
def test_no_background_shines_through_a_crumpled_surface(quality):
    ball = sphere_surface((0, 0, 0), 0.5, Material("solid", "#c00000"), rings=60)
    n = ball.normals
    x = 0.5 * n * (1 + 0.1 * np.sin(23 * n[:, :1]) * np.sin(19 * n[:, 1:2]) * np.sin(21 * n[:, 2:]))
    crumpled = Surface(x, ball.triangles, ball.material)
    rng = np.random.default_rng(4)
    size = (200, 200)
    row, column = np.mgrid[:200, :200] + 0.5
    for _ in range(4):
        eye = 2 * unit(rng.normal(size=3))
        camera = Camera(eye=tuple(eye), fov=34)
        image = draw([crumpled], camera, size, quality, light=FLAT, background="#00ff00")
        inside = np.hypot(row - 100, column - 100) < camera.focal(size) * 0.42 / 2
        assert inside.sum() > 10000
        assert image[inside][:, 1].max() < 40


def unit(v):
    return v / np.linalg.norm(v)


def srgb_to_light(c):
    c = np.asarray(c) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def shown(own, strength=0.6):
    """sRGB values of a surface's own linear colour under FLAT, through the tone curve."""
    light = strength * np.asarray(own)
    return 255 * srgb(np.where(light > 0.7, 1 - 0.3 * np.exp(-(light - 0.7) / 0.3), light))


def test_values_are_interpolated_in_space_and_not_in_the_picture():
    camera = Camera(eye=(0, 0.4, 1.2), target=(0, 0, -1), fov=60)
    x = np.array([[-1.0, 0, 1], [1, 0, 1], [1, 0, -6], [-1, 0, -6]])
    lo, hi = 0.5, 1.5
    values = np.interp(x[:, 2], [-6, 1], [lo, hi])
    floor = Surface(x, [[0, 1, 2], [0, 2, 3]], Material("strain", lo=lo, hi=hi), values=values)
    image = draw([floor], camera, SIZE, "draft", light=FLAT, background="#00ff00").astype(int)
    d = rays(camera, SIZE)
    with np.errstate(divide="ignore"):
        p = np.asarray(camera.eye) + d * (-camera.eye[1] / d[..., 1:2])
    on = (np.abs(p[..., 0]) < 0.99) & (p[..., 2] > -5.9) & (p[..., 2] < 0.99) & (d[..., 1] < 0)
    value = np.interp(p[..., 2], [-6, 1], [lo, hi])
    table = strain_table(256)
    place = strain_position(value, lo, hi) * 255
    own = np.stack([np.interp(place, np.arange(256), table[:, c]) for c in range(3)], axis=-1)
    assert on.sum() > 3000
    assert np.abs(image - shown(own))[on].max() <= 1.5


def test_the_back_has_its_own_colour():
    x, t, _ = grid(4, "z")
    cloth = Surface(x, t, Material("solid", "#c00000", back="#0000c0"))
    for eye, strong in (((0, 0, 3), 0), ((0, 0, -3), 2)):
        middle = draw([cloth], Camera(eye=eye), SIZE, "good", light=FLAT)[60, 80]
        assert middle.argmax() == strong


def test_nothing_to_draw_gives_the_background():
    image = draw([], Camera(), SIZE, "good", background="#336699")
    assert (image == [0x33, 0x66, 0x99]).all()
    graded = draw([], Camera(), SIZE, "draft", background=("#000000", "#ffffff"))
    assert (np.diff(graded[:, 0, 0].astype(int)) >= 0).all()
    nothing = Surface(np.zeros((0, 3)), np.zeros((0, 3), int), Material("solid"))
    assert (draw([nothing], Camera(), SIZE, background="#336699") == [0x33, 0x66, 0x99]).all()


@pytest.mark.parametrize("quality", ["draft", "good", "best"])
def test_any_size_can_be_drawn(quality):
    scene, camera = draped(8)
    for size in ((61, 35), (1, 1)):
        assert draw(scene, camera, size, quality).shape == (size[1], size[0], 3)


# Light


@pytest.mark.parametrize("quality", ["draft", "good"])
@pytest.mark.parametrize(
    "sun", [(0.2, 1, 0.1), (-1, 0.6, 0.4), (1, 0.15, 0.3)], ids=["high", "slanting", "low"]
)
def test_a_lit_plane_is_evenly_bright(quality, sun):
    x, t, _ = grid(40)
    plane = Surface(x, t, Material("solid", "#a0a0a0"))
    camera = Camera(eye=(0.3, 0.7, 0.9), target=(0, 0, 0))
    image = draw([plane], camera, SIZE, quality, light=Light(direction=sun)).astype(int)
    place = np.random.default_rng(2).uniform(-0.45, 0.45, size=(4000, 2))
    p = camera.project(np.stack([place[:, 0], 0 * place[:, 0], place[:, 1]], axis=1), SIZE)[:, :2].astype(int)
    p = p[((p >= 0) & (p < SIZE)).all(axis=1)]
    assert len(p) > 2000
    inside = p[:, 1], p[:, 0]
    assert np.ptp(image[inside], axis=0).max() <= 2


@pytest.mark.parametrize("quality", ["draft", "good"])
def test_a_shadow_falls_where_the_sun_throws_it(quality):
    x, t, _ = grid(9, size=0.4)
    x[:, 1] = 0.5
    sun = np.array([-0.6, 1.0, 0.35])
    scene = [Surface(x, t, Material("solid", "#a0a0a0")), ground_surface(0)]
    camera = Camera(eye=(0.6, 2.2, 2.4), target=(0.2, 0, 0), fov=40)
    image = draw(scene, camera, SIZE, quality, light=Light(direction=tuple(sun), softness=1.0)).astype(int)
    place = np.random.default_rng(1).uniform(-0.9, 1.1, size=(3000, 2))
    ground = np.stack([place[:, 0], 0 * place[:, 0], place[:, 1]], axis=1)
    above = ground + sun / sun[1] * 0.5  # where the sun's ray crosses the cloth's height
    far = 0.2 - np.abs(above[:, [0, 2]]).max(axis=1)  # from the shadow's border, positive inside
    pixel = camera.project(ground, SIZE)
    # Drop what the cloth itself hides from the camera.
    eye = np.asarray(camera.eye)
    toward = ground + (eye - ground) * (0.5 / eye[1])
    free = np.abs(toward[:, [0, 2]]).max(axis=1) > 0.23
    inside_picture = ((pixel[:, :2] >= 1) & (pixel[:, :2] < np.array(SIZE) - 1)).all(axis=1)
    shade = image[pixel[:, 1].astype(int) % SIZE[1], pixel[:, 0].astype(int) % SIZE[0]].mean(axis=1)
    dark, bright = shade[free & inside_picture & (far > 0.04)], shade[free & inside_picture & (far < -0.04)]
    assert len(dark) > 50
    assert len(bright) > 500
    assert dark.max() < bright.min() - 25


def test_no_light_leaks_between_an_object_and_its_shadow():
    """A box's side that stands on the ground: just behind its foot the ground is dark."""
    x = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    wall = Surface(x, [[0, 1, 2], [0, 2, 3]], Material("solid", "#808080"))
    camera = Camera(eye=(0, 2.0, -2.0), target=(0, 0, -0.1), fov=25)
    light = Light(direction=(0, 0.7, 1), sky_strength=0.1, floor_strength=0, softness=0.3)
    image = draw([wall, ground_surface(0)], camera, (320, 240), "good", light=light).astype(int)
    foot = camera.project([[0, 0, -0.01], [0, 0, -0.3]], (320, 240))
    lit = camera.project([[0.9, 0, -0.3]], (320, 240))[0]
    behind_foot, deep = (image[int(p[1]), int(p[0])].mean() for p in foot)
    assert behind_foot <= deep + 12
    assert image[int(lit[1]), min(int(lit[0]), 319)].mean() > deep + 60


@pytest.mark.parametrize("quality", ["draft", "good", "best"])
def test_large_triangles_of_a_round_surface_do_not_stand_in_their_own_light(quality):
    """Nothing stands before the sun of a ball's lit half: the picture is that without shadows."""
    white = Material("solid", "#ffffff", sheen=0, translucency=0)
    ball = sphere_surface((0, 0, 0), 1, white, rings=8)
    camera, size = Camera(eye=(0, 1.5, 5)), (200, 200)
    for direction in ((-0.75, 0.9, 0.5), (-1, 0.1, -0.3), (0.2, 1, -0.2)):
        light = Light(direction, sky_strength=0, floor_strength=0)
        alone, unshaded = (
            draw([s], camera, size, quality, light, "#000000").astype(int)
            for s in (ball, dataclasses.replace(ball, casts_shadow=False))
        )
        assert (unshaded > 0).sum() > 4_000  # of about 16,000 that show the ball
        assert np.abs(alone - unshaded).max() <= 2


def test_the_sky_is_dimmer_under_an_object():
    scene = [sphere_surface((0, 0.3, 0), 0.25), ground_surface(0)]
    light = Light(sun_strength=0)
    camera = Camera(eye=(0, 1.0, 4), target=(0, 0.2, 0), fov=20)
    image = draw(scene, camera, SIZE, "good", light=light).astype(int)
    under, away = camera.project([[0, 0, 0.1], [0.55, 0, 0.6]], SIZE)[:, :2].astype(int)
    assert image[under[1], under[0]].mean() < image[away[1], away[0]].mean() - 30


def test_the_ground_melts_into_the_background():
    camera = Camera(eye=(0, 0.6, 3), target=(0, 0.3, 0), fov=40)
    image = draw([ground_surface(0)], camera, (160, 240), "good").astype(int)
    assert np.abs(np.diff(image, axis=0)).max() <= 4
    assert np.ptp(image, axis=0).max() > 0


# Materials


def test_a_weave_finer_than_the_pixels_is_smooth_and_a_coarse_one_shows():
    x, t, uv = grid(12, "z")
    camera = Camera(eye=(0, 0, 2.2), fov=30)
    spread = {}
    for scale in (0.0004, 0.05):
        cloth = Surface(x, t, Material("weave", "#b09060", scale=scale), uv=uv)
        image = draw([cloth], camera, SIZE, "draft", light=FLAT)[30:90, 50:110].astype(float)
        spread[scale] = image.std(axis=(0, 1)).max()
    assert spread[0.0004] < 2 < 6 < spread[0.05]


def test_a_checker_has_its_two_colours_in_the_right_squares():
    x, t, uv = grid(5, "z")
    camera = Camera(eye=(0, 0, 3), fov=30)
    cloth = Surface(x, t, Material("checker", "#c00000", second="#0000c0", scale=0.25), uv=uv)
    image = draw([cloth], camera, SIZE, "good", light=FLAT)
    for i in range(-2, 2):
        for j in range(-2, 2):
            px, py, _ = camera.project([[0.25 * i + 0.125, 0.25 * j + 0.125, 0]], SIZE)[0]
            assert image[int(py), int(px)].argmax() == (0 if (i + j) % 2 == 0 else 2)


def test_strain_colours_darken_monotonically_from_white_at_rest_to_blue_and_to_red():
    stretch = np.linspace(0.8, 1.3, 401)
    colour = strain_colours(stretch, 0.8, 1.3).astype(int)
    lightness = srgb_to_light(colour) @ [0.2126, 0.7152, 0.0722]
    rest = np.argmin(np.abs(stretch - 1))
    assert (np.diff(lightness[: rest + 1]) >= -1e-3).all()
    assert (np.diff(lightness[rest:]) <= 1e-3).all()
    assert np.ptp(colour[rest]) <= 10
    assert lightness[rest] > 0.85
    assert colour[0, 2] > colour[0, 0] + 60
    assert colour[-1, 0] > colour[-1, 2] + 60


def test_the_legend_shows_the_whole_scale_in_its_corner():
    plain = draw([], Camera(), (640, 360), "draft", background="#808080")
    image = draw([], Camera(), (640, 360), "draft", background="#808080", legend=Legend(0.9, 1.1))
    changed = differs(image, plain)
    rows, columns = np.nonzero(changed)
    assert rows.min() > 180
    assert columns.min() > 320
    for stretch in (0.901, 0.95, 1.05, 1.099):
        colour = strain_colours(stretch, 0.9, 1.1).astype(int)
        assert (np.abs(image.astype(int) - colour).max(axis=2) <= 3).any()


def test_a_wireframe_draws_the_cloths_edges_and_leaves_props_alone():
    x, t, _ = grid(3, "z")
    camera = Camera(eye=(0, 0, 3), fov=30)
    cloth = [Surface(x, t, Material("solid", "#e0e0e0"))]
    size = (400, 300)
    plain, wired = (
        draw(cloth, camera, size, "good", light=FLAT, wireframe=w).astype(int) for w in (False, True)
    )
    on_edge, inside = camera.project([[0, 0.2, 0], [0.1, 0.3, 0]], size)[:, :2].astype(int)
    assert wired[on_edge[1], on_edge[0], 0] < plain[on_edge[1], on_edge[0], 0] - 20
    assert (wired[inside[1], inside[0]] == plain[inside[1], inside[0]]).all()
    ball = [sphere_surface((0, 0, 0), 0.5)]
    assert (draw(ball, camera, SIZE, wireframe=True) == draw(ball, camera, SIZE)).all()


def test_shapes_are_closed_wound_outwards_and_of_the_right_size():
    for shape, volume in (
        (sphere_surface((1, 2, 3), 0.5), 4 / 3 * np.pi * 0.5**3),
        (capsule_surface((0, 0, 0), (1, 1, 0), 0.3), 4 / 3 * np.pi * 0.3**3 + np.pi * 0.09 * np.sqrt(2)),
    ):
        a, b, c = (np.asarray(shape.vertices)[shape.triangles[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=0.02)
        facet = np.cross(b - a, c - a)
        assert (np.einsum("ij,ij->i", facet, shape.normals[shape.triangles[:, 0]]) > 0).all()
        edges = np.sort(np.concatenate([shape.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    for up in "xyz":
        disc = ground_surface(0.5, up=up)
        a, b, c = (disc.vertices[disc.triangles[:, k]] for k in range(3))
        assert np.cross(b - a, c - a)["xyz".index(up) == np.arange(3)].size if False else True
        assert (np.cross(b - a, c - a)[:, "xyz".index(up)] > 0).all()


# Files and refusals


def test_a_png_is_read_back_as_it_was_drawn(tmp_path):
    from PIL import Image

    image = text_overlay(draw([], Camera(), SIZE, "draft"), "t = 1.50 s")
    path = write_png(tmp_path / "new" / "a.png", image)
    assert (np.array(Image.open(path)) == image).all()
    assert len(np.unique(image)) > 5
    (tmp_path / "file").write_text("")
    with pytest.raises(MuslinError, match="cannot be written"):
        write_png(tmp_path / "file" / "a.png", image)


def test_a_vertex_that_is_not_a_number_is_named():
    x, t, _ = grid(4)
    x[7, 1] = np.nan
    with pytest.raises(MuslinError, match="Vertex 7 of cape"):
        draw([Surface(x, t, Material("solid"), name="cape")], Camera(), SIZE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"triangles": [[0, 1, 99]]}, "vertex 99"),
        ({"vertices": np.zeros((4, 2))}, r"\(4, 2\)"),
        ({"triangles": np.zeros((2, 4), int)}, r"\(2, 4\)"),
        ({"material": Material("weave")}, "no uv"),
        ({"material": Material("strain")}, "no values"),
        ({"values": np.zeros(3)}, r"\(3,\)"),
        ({"values": np.full(16, np.inf)}, "not finite"),
    ],
)
def test_a_surface_that_cannot_be_drawn_is_refused(change, message):
    x, t, _ = grid(4)
    with pytest.raises(MuslinError, match=message):
        draw(
            [Surface(**{"vertices": x, "triangles": t, "material": Material("solid"), **change})],
            Camera(),
            SIZE,
        )


def test_words_that_mean_nothing_are_refused():
    with pytest.raises(MuslinError, match="draft, good, best"):
        draw([], Camera(), SIZE, "superb")
    with pytest.raises(MuslinError, match="weave"):
        Material("velvet")
    with pytest.raises(MuslinError, match="rrggbb"):
        linear("red")
    with pytest.raises(MuslinError, match="does not contain 1"):
        Material("strain", lo=1.1, hi=1.2)


@pytest.mark.parametrize("height", [270, 300, 360, 432, 480, 540, 600, 720, 1080])
def test_the_dot_of_a_number_is_seen_at_every_size(height):
    """A dot is what has ink at the foot of a line and none above; noughts have none such."""

    class Noughts(Legend):
        def label(self, t):
            return "00.0"

    def dots(line):
        line = line.astype(int).mean(axis=2)
        ink = np.flatnonzero((line < 110).any(axis=1))
        foot, above = line[ink[-1] - len(ink) // 4 : ink[-1] + 1], line[: ink[-1] - len(ink) // 3]
        there = (foot.min(axis=0) < 110) & (above.min(axis=0) > 200)
        return (np.diff(there.astype(int)) == 1).sum()

    paper = np.full((height, height * 16 // 9, 3), 240, np.uint8)
    unit = max(height / 720, 0.4)
    scaled = draw_legend(paper, Noughts(0.5, 2, "stress"))
    bottom, right = height - int(20 * unit), paper.shape[1] - int(20 * unit)
    panel = scaled[
        bottom - int(82 * unit) + int(57 * unit) : bottom - 1, right - int(300 * unit) + 1 : right - 1
    ]
    assert dots(panel) == 5
    assert dots(text_overlay(paper, "0.0")[: height // 8, : height // 2]) == 1
