"""Frames to a file: PNG for one, GIF by Pillow, MP4 by `ffmpeg` where it is installed."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Frame = NDArray[np.uint8]
KINDS = ('.png', '.gif', '.mp4')
#: Colours of a GIF: few surfaces, each in some shades.
_COLOURS = 64
#: Frames whose colours make the palette.
_SAMPLES = 8


def check_kind(path: Path) -> None:
    """Refuse a file that cannot be written; ``ValueError`` says which can."""
    if path.suffix not in KINDS:
        msg = f'{path} must end in {", ".join(KINDS)}'
        raise ValueError(msg)
    if path.suffix == '.mp4' and shutil.which('ffmpeg') is None:
        msg = f'{path}: MP4 needs the program ffmpeg, which is not installed; a GIF needs nothing'
        raise ValueError(msg)


def write_film(path: Path, frames: Iterator[Frame], frames_per_s: float) -> None:
    """Write ``frames``, of which a PNG takes the first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == '.mp4':
        _write_mp4(path, frames, frames_per_s)
        return
    first = Image.fromarray(next(frames))
    if path.suffix == '.png':
        first.save(path, optimize=True)
        return
    every = [first, *map(Image.fromarray, frames)]
    # One palette and no dithering, so that what stands still is the same in every frame.
    some = every[:: max(1, len(every) // _SAMPLES)]
    sheet = Image.new('RGB', (first.width, first.height * len(some)))
    for number, image in enumerate(some):
        sheet.paste(image, (0, number * first.height))
    colours = sheet.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    palette, *rest = (image.quantize(palette=colours, dither=Image.Dither.NONE) for image in every)
    palette.save(
        path, save_all=True, append_images=rest, duration=round(1000 / frames_per_s), loop=0,
        optimize=False,
    )  # fmt: skip


def _write_mp4(path: Path, frames: Iterator[Frame], frames_per_s: float) -> None:
    first = next(frames)
    height, width, _ = first.shape
    command = [
        *('ffmpeg', '-y', '-loglevel', 'error', '-f', 'rawvideo', '-pix_fmt', 'rgb24'),
        *('-s', f'{width}x{height}', '-r', f'{frames_per_s:g}', '-i', '-'),
        *('-pix_fmt', 'yuv420p', '-movflags', '+faststart', str(path)),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as film:
        assert film.stdin is not None
        # One that has ended before all was written tells by its code why.
        with contextlib.suppress(BrokenPipeError):
            film.stdin.write(first.tobytes())
            for frame in frames:
                film.stdin.write(frame.tobytes())
            film.stdin.close()
    if film.returncode:
        msg = f'ffmpeg could not write {path}: exit code {film.returncode}'
        raise OSError(msg)
