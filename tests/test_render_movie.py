"""Movies can be decoded, have every frame, and survive interruptions."""

import os
import stat

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from muslin.base.errors import MuslinError
from muslin.render import Movie, write_movie


def frames(n, size=(64, 48)):
    for i in range(n):
        image = np.full((size[1], size[0], 3), 40, dtype=np.uint8)
        image[:, : 4 * (i + 1)] = (200, 120 + 10 * i, 30)
        yield image


def decode_mp4(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    about = next(reader)
    width, height = about["size"]
    return about, [np.frombuffer(f, np.uint8).reshape(height, width, 3) for f in reader]


def decode_pillow(path):
    with Image.open(path) as movie:
        out, times = [], []
        for k in range(movie.n_frames):
            movie.seek(k)
            out.append(np.array(movie.convert("RGB")))
            times.append(movie.info["duration"])
    return out, times


def test_an_mp4_has_every_frame_and_plays_everywhere(tmp_path):
    path = write_movie(tmp_path / "deep" / "a.mp4", frames(9), fps=25)
    about, seen = decode_mp4(path)
    assert len(seen) == 9
    assert about["fps"] == 25
    assert about["codec"] == "h264"
    assert "yuv420p" in about["pix_fmt"]
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # the index in front: it starts before it is all there
    for a, b in zip(frames(9), seen, strict=True):
        assert np.abs(a.astype(int) - b).mean() < 4


def test_an_odd_size_is_made_even(tmp_path):
    about, seen = decode_mp4(write_movie(tmp_path / "a.mp4", frames(3, (63, 47))))
    assert about["size"] == (64, 48)
    assert len(seen) == 3


@pytest.mark.parametrize("ending", [".webp", ".gif"])
def test_an_animation_has_every_frame_and_lasts_as_long_as_it_should(tmp_path, ending):
    seen, times = decode_pillow(write_movie(tmp_path / f"a{ending}", frames(9), fps=30))
    assert len(seen) == 9
    assert sum(times) == pytest.approx(300, abs=10)
    for a, b in zip(frames(9), seen, strict=True):
        assert np.abs(a.astype(int) - b).mean() < 6


def test_a_fast_gif_drops_frames_and_keeps_its_time(tmp_path):
    seen, times = decode_pillow(write_movie(tmp_path / "a.gif", frames(12), fps=60))
    assert len(seen) == 6
    assert sum(times) == 200


def test_a_folder_holds_one_picture_per_frame(tmp_path):
    write_movie(tmp_path / "frames", frames(3))
    names = sorted(p.name for p in (tmp_path / "frames").iterdir())
    assert names == ["frame_00000.png", "frame_00001.png", "frame_00002.png"]


@pytest.mark.parametrize("ending", [".mp4", ".webp", ".gif"])
@pytest.mark.parametrize("reason", [KeyboardInterrupt, ValueError])
def test_an_interrupted_movie_plays_what_it_has(tmp_path, ending, reason):
    path = tmp_path / f"a{ending}"

    def interrupted():
        with Movie(path, (64, 48), 30) as movie:
            for k, frame in enumerate(frames(9)):
                if k == 4:
                    raise reason
                movie.add(frame)

    with pytest.raises(reason):
        interrupted()
    seen = decode_mp4(path)[1] if ending == ".mp4" else decode_pillow(path)[0]
    assert len(seen) == 4


def test_a_movie_without_frames_leaves_no_file(tmp_path):
    for name in ("a.mp4", "a.gif"):
        with Movie(tmp_path / name, (64, 48)):
            pass
        assert not (tmp_path / name).exists()
    with pytest.raises(MuslinError, match="no frames"):
        write_movie(tmp_path / "a.mp4", [])


def test_a_missing_encoder_is_named_with_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "nowhere"))
    with pytest.raises(MuslinError, match=r"pip install|\.webp"):
        write_movie(tmp_path / "a.mp4", frames(2))


@pytest.mark.skipif(os.name == "nt", reason="needs a shell script as the encoder")
def test_an_encoder_that_fails_is_quoted(tmp_path, monkeypatch):
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\necho 'disk on fire' >&2\nexit 1\n")
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("muslin.render.movie.encoder", lambda: str(fake))
    with pytest.raises(MuslinError, match="disk on fire"):
        write_movie(tmp_path / "a.mp4", frames(400))


def test_no_encoder_process_is_left_behind(tmp_path):
    movie = Movie(tmp_path / "a.mp4", (64, 48))
    process = movie._writer.process
    movie.add(next(frames(1)))
    movie.close()
    movie.close()
    assert process.wait(0) == 0


def test_wrong_frames_endings_and_places_are_refused(tmp_path):
    with pytest.raises(MuslinError, match=r"\.mp4, \.webp, \.gif"):
        Movie(tmp_path / "a.avi", (64, 48))
    with pytest.raises(MuslinError, match="cannot be"):
        Movie(tmp_path / "a.mp4", (0, 48))
    (tmp_path / "file").write_text("")
    with pytest.raises(MuslinError, match="cannot be written"):
        Movie(tmp_path / "file" / "a.mp4", (64, 48))
    with (
        Movie(tmp_path / "b.mp4", (64, 48)) as movie,
        pytest.raises(MuslinError, match=r"\(10, 10, 3\)"),
    ):
        movie.add(np.zeros((10, 10, 3), np.uint8))
