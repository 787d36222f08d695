"""Moving pictures: frames in one by one, a file that plays everywhere out."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.base.child import Child
from muslin.base.errors import MuslinError

Image = NDArray[np.uint8]


class Movie:
    """A writer of frames, to be used in a `with` statement.

    The extension decides the format:

    - `.mp4`: H.264 (yuv420p, index in front), streamed to the encoder that comes with imageio-ffmpeg.
      An odd width or height is made even by repeating the last column or row.
    - `.webp`, `.gif`: animated through Pillow, kept compressed in memory and written on leaving. A GIF
      cannot run faster than 50 frames per second: beyond that, frames are dropped to keep the time right.
    - anything without an extension: a folder of `frame_00000.png`, ...

    However the `with` block ends, by an error or by Ctrl-C, what was added until then is closed properly and
    plays.

    Parameters
    ----------
    path : str or Path
    size : (width, height) in pixels
    fps : float
        Frames per second.

    Raises
    ------
    MuslinError
        If the extension is unknown, the encoder is missing or fails, a frame has the wrong shape, or the
        file cannot be written.
    """

    def __init__(self, path: str | Path, size: tuple[int, int], fps: float = 30.0):
        self.path = Path(path)
        self.size = (int(size[0]), int(size[1]))
        self.fps = float(fps)
        self.frames = 0
        if not (self.fps > 0 and self.size[0] > 0 and self.size[1] > 0):
            raise MuslinError(
                f"A movie of {self.size[0]} x {self.size[1]} pixels at {fps} frames per second cannot be."
            )
        writers = {".mp4": _Mp4, ".webp": _Animation, ".gif": _Animation, "": _Folder}
        kind = writers.get(self.path.suffix.lower())
        if kind is None:
            raise MuslinError(
                f"A movie cannot be written as {self.path.name}.",
                "Use .mp4, .webp, .gif, or a name without an extension for a folder of pictures.",
            )
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._writer: Any = kind(self.path, self.size, self.fps)
        except OSError as error:
            raise _cannot_write(self.path, error) from None

    def add(self, image: Image) -> None:
        """Append one frame, (height, width, 3) uint8."""
        width, height = self.size
        if image.shape != (height, width, 3) or image.dtype != np.uint8:
            raise MuslinError(
                f"A frame of {self.path.name} has shape {image.shape} and type {image.dtype}"
                f" instead of ({height}, {width}, 3) and uint8."
            )
        try:
            self._writer.add(np.ascontiguousarray(image))
        except OSError as error:
            raise _cannot_write(self.path, error) from None
        self.frames += 1

    def close(self) -> None:
        """Finish the file; harmless when done twice."""
        writer, self._writer = self._writer, None
        if writer is not None:
            try:
                writer.close(self.frames)
            except OSError as error:
                raise _cannot_write(self.path, error) from None

    def __enter__(self) -> Movie:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        try:
            self.close()
        except MuslinError:
            if kind is None:  # else the first error is the one to tell
                raise


def write_movie(path: str | Path, frames: Iterable[Image], fps: float = 30.0) -> Path:
    """Write all `frames` to `path`; see `Movie`. Returns the path.

    Raises
    ------
    MuslinError
        As `Movie`, or if there are no frames.
    """
    rest = iter(frames)
    first = next(rest, None)
    if first is None:
        raise MuslinError(f"There are no frames to write to {Path(path).name}.")
    with Movie(path, (first.shape[1], first.shape[0]), fps) as movie:
        movie.add(first)
        for frame in rest:
            movie.add(frame)
    return Path(path)


class _Mp4:
    """Raw frames down a pipe to ffmpeg."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float):
        self.path = path
        self.pad = (size[1] % 2, size[0] % 2)
        path.touch()  # a place that cannot be written is told here, in our words
        width, height = size[0] + self.pad[1], size[1] + self.pad[0]
        command = [
            encoder(), "-loglevel", "error", "-y",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:.6g}", "-i", "-",
            "-an", "-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd",
            "-c:v", "libx264", "-preset", "veryfast", "-crf", "17", "-pix_fmt", "yuv420p",
            "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709",
            "-movflags", "+faststart", str(path.resolve()),
        ]  # fmt: skip
        try:
            self.process = Child(command)  # out of reach of Ctrl-C: it must live to close the file
        except OSError as error:
            raise MuslinError(f"The video encoder {command[0]} cannot be started: {error}.", _MEND) from None

    def add(self, image: Image) -> None:
        if any(self.pad):
            image = np.pad(image, ((0, self.pad[0]), (0, self.pad[1]), (0, 0)), mode="edge")
        if not self.process.say(image.data):
            raise self._failure()

    def close(self, frames: int) -> None:
        self.process.said_all()
        self.process.wait()
        code = self.process.close()
        if frames == 0:
            self.path.unlink(missing_ok=True)
        elif code != 0:
            raise self._failure()

    def _failure(self) -> MuslinError:
        self.process.said_all()
        self.process.wait()
        self.process.close()
        said = self.process.last_error()
        return MuslinError(f"The video encoder failed on {self.path.name}{said and f': {said}'}.", _MEND)


class _Animation:
    """Frames for Pillow, each compressed until the end."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float):
        self.path, self.size, self.fps = path, size, fps
        self.gif = path.suffix.lower() == ".gif"
        self.every = max(1, int(np.ceil(fps / 50 - 1e-9))) if self.gif else 1
        self.packed: list[bytes] = []
        self.seen = 0
        path.touch()

    def add(self, image: Image) -> None:
        if self.seen % self.every == 0:
            self.packed.append(zlib.compress(image.tobytes(), 1))
        self.seen += 1

    def close(self, frames: int) -> None:
        if not self.packed:
            self.path.unlink(missing_ok=True)
            return
        step = 1000 * self.every / self.fps
        unit = 10 if self.gif else 1  # the format counts in hundredths of a second
        ends = [unit * round(step * (i + 1) / unit) for i in range(len(self.packed))]
        durations = [b - a for a, b in zip([0, *ends], ends, strict=False)]
        pictures = self._unpack()
        first = next(pictures)
        options: dict[str, Any] = {"save_all": True, "append_images": pictures, "loop": 0}
        # Pillow wants one number rather than a list of one.
        options["duration"] = durations if len(durations) > 1 else durations[0]
        if self.gif:
            first.save(self.path, format="GIF", disposal=1, **options)
        else:
            first.save(self.path, format="WEBP", quality=85, method=3, **options)

    def _unpack(self) -> Iterator[Any]:
        from PIL import Image as Pillow

        for data in self.packed:
            picture = Pillow.frombytes("RGB", self.size, zlib.decompress(data))
            yield picture.quantize(256, dither=Pillow.Dither.FLOYDSTEINBERG) if self.gif else picture


class _Folder:
    """One PNG per frame."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float):
        self.path = path
        self.count = 0
        path.mkdir(parents=True, exist_ok=True)

    def add(self, image: Image) -> None:
        from PIL import Image as Pillow

        Pillow.fromarray(image).save(self.path / f"frame_{self.count:05d}.png", compress_level=3)
        self.count += 1

    def close(self, frames: int) -> None:
        pass


_MEND = (
    "Install it again with: pip install --force-reinstall imageio-ffmpeg; or write .webp, .gif or a folder."
)


def encoder() -> str:
    """Path of the ffmpeg program.

    Raises
    ------
    MuslinError
        If imageio-ffmpeg is not installed or came without a program for this system.
    """
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError, OSError) as error:
        raise MuslinError(f"There is no video encoder ({str(error).splitlines()[0]}).", _MEND) from None


def _cannot_write(path: Path, error: OSError) -> MuslinError:
    return MuslinError(f"{path} cannot be written: {error.strerror or error}.")
