"""A film made while its run is simulated is the film of the run, and no process outlives it."""

import time

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from muslin.base.errors import MuslinError
from muslin.present.film import Filming
from muslin.present.pictures import Show, render_run
from muslin.simulation import scenes
from muslin.simulation.runs import RunFolder
from muslin.simulation.simulating import simulate

AROUND = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.4, 0.4) for z in (-0.5, 0.5)]
SCENE = scenes.get("drape", resolution=6, steps=12)


def filming(folder, **options):
    options = {"around": AROUND, "quality": "draft", "size": (96, 64), **options}
    return Filming(SCENE, folder / "run", folder / "drape", **options)


def simulated(folder, on_step):
    return simulate(SCENE, out=folder / "run", on_step=on_step)


def frames_of(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    next(reader)
    return len(list(reader))


def test_a_run_is_filmed_while_it_is_simulated(tmp_path):
    first, ticks = [], []
    with filming(tmp_path, on_first=first.append) as film:
        child = film._child
        simulated(tmp_path, film.on_step)
        written = film.finish(lambda frame, frames: ticks.append((frame, frames)))
    assert first == [tmp_path / "drape.png"]
    assert [path.name for path in written] == ["drape.png", "drape-energies.png", "drape.mp4"]
    assert frames_of(tmp_path / "drape.mp4") == 4  # steps 0, 4, 8, 12
    assert ticks[-1] == (4, 4)
    assert child.wait(0) == 0
    still = np.array(Image.open(tmp_path / "drape.png"))
    show = Show(RunFolder(tmp_path / "run"), (96, 64), "draft", around=AROUND)
    assert (still == show.picture(3)).all()  # of 0.65 s, the nearest there is


def test_fewer_frames_are_filmed_on_demand(tmp_path):
    with filming(tmp_path, every=2) as film:
        simulated(tmp_path, film.on_step)
        film.finish()
    assert frames_of(tmp_path / "drape.mp4") == 2


def test_without_a_second_process_the_film_is_made_afterwards(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.executable", str(tmp_path / "nowhere"))
    with filming(tmp_path) as film:
        simulated(tmp_path, film.on_step)
        written = film.finish()
    assert all(path.is_file() for path in written)
    assert frames_of(tmp_path / "drape.mp4") == 4


def test_a_child_that_dies_without_a_word_is_replaced(tmp_path):
    with filming(tmp_path) as film:
        film._child.kill()
        simulated(tmp_path, film.on_step)
        assert all(path.is_file() for path in film.finish())


def test_what_the_child_cannot_do_is_told_by_the_parent(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "nowhere"))

    def attempt():
        with filming(tmp_path) as film:
            simulated(tmp_path, film.on_step)
            film.finish()

    with pytest.raises(MuslinError, match=r"pip install|\.webp"):
        attempt()


def test_an_interrupted_film_plays_and_leaves_no_process(tmp_path):
    def interrupted():
        with filming(tmp_path) as film:
            children.append(film._child)
            simulated(tmp_path, film.on_step)
            for _ in range(1200):
                if not film._said.empty() and "frame" in film._said.get():
                    raise KeyboardInterrupt
                time.sleep(0.05)

    children = []
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert children[0].wait(0) == 0
    assert frames_of(tmp_path / "drape.mp4") >= 1


def test_what_happens_after_the_still_does_not_change_it(tmp_path):
    """A cloth that falls away later would make it smaller and smaller."""
    stills, films = [], []
    for name, steps in (("short", 4), ("long", 120)):
        run = tmp_path / name
        simulate("drape", resolution=4, sphere=False, floor=False, steps=steps, out=run)
        written = render_run(run, film="none", still=4 / 240, size=(96, 64), quality="draft")
        stills.append(np.array(Image.open(written[0])))
        films.append(Show(RunFolder(run), (96, 64), "draft").picture(1))
    assert (stills[0] == stills[1]).all()
    assert (films[0] == stills[0]).all()
    assert (films[1] != stills[1]).any(), "the film is framed by all of it"
