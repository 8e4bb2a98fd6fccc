"""What a run is begun with, kept in its folder, so that it can be gone on with after a power cut.

``config/run.json`` holds the command and every option, ``config/kept`` a copy of each file that
they name. The nodes read the copies from the start, so nothing changes when a file does.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from arm_executor.bins.start_bins import read_start_bins, renamed, write_start_bins
from conveyor_sim.streams import with_path
from pack_cell.files import naming
from pack_cell.options.option_texts import conflicts, options_from, texts_of
from pack_cell.options.run_options import RunOptions, open_stream

FILE_NAME = 'run.json'
_FORMAT = 1
#: What of the folder of an earlier run boxes are read from.
_OF_A_RUN = ('boxes.csv', 'placements.jsonl')


class NotResumable(ValueError):
    """A folder holds no run that can be gone on with as asked; the text says why."""


@dataclass(frozen=True)
class KeptRun:
    """A run and where it is kept.

    Attributes
    ----------
    folder : of the run.
    asked : the options as they were given.
    command : words of the command line.
    """

    folder: Path
    asked: RunOptions
    command: tuple[str, ...]

    @property
    def used(self) -> RunOptions:
        """The options with the copies of the files that they name."""
        return _with_files(self.asked, self._copy_of)

    @property
    def _copies(self) -> Path:
        return self.folder / 'config' / 'kept'

    def write(self) -> None:
        """Copy the files, then write down what the run is begun with; on the disk when it returns.

        Raises
        ------
        OSError
            A file cannot be read, or the folder cannot be written.
        """
        (self.folder / 'config').mkdir(parents=True, exist_ok=True)
        _with_files(self.asked, self._copy)
        content = {
            'format': _FORMAT,
            'command': list(self.command),
            'options': texts_of(self.asked),
        }
        path = self.folder / 'config' / FILE_NAME
        fresh = path.with_suffix('.new')
        with naming(fresh), fresh.open('w', encoding='utf-8') as file:
            file.write(json.dumps(content, indent=1) + '\n')
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)

    def _copy_of(self, key: str, source: Path) -> Path:
        return self._copies / key / ('bins.json' if key == 'start_bins' else source.name)

    def _copy(self, key: str, source: Path) -> Path:
        source, target = source.expanduser(), self._copy_of(key, source)
        target.parent.mkdir(parents=True, exist_ok=True)
        if key == 'start_bins':
            # A box of the stream may be called like one of an earlier run.
            stream = open_stream(self.asked)
            with naming(target):
                write_start_bins(target, renamed(read_start_bins(source), stream.__contains__))
            return target
        if source.is_dir():
            target.mkdir(exist_ok=True)
            for name in filter(lambda name: (source / name).exists(), _OF_A_RUN):
                shutil.copyfile(source / name, target / name)
            return target
        shutil.copyfile(source, target)
        sidecar = source.with_name(f'{source.name}.yaml')
        if sidecar.is_file():
            shutil.copyfile(sidecar, target.with_name(sidecar.name))
        return target


def is_begun(folder: Path) -> bool:
    """Whether ``folder`` holds a run, or the books of one."""
    return (folder / 'state').exists() or (folder / 'config' / FILE_NAME).exists()


def kept_run(folder: Path, given: Mapping[str, Any]) -> KeptRun:
    """The run in ``folder``, to be gone on with; ``given`` are options of now, by key.

    Raises
    ------
    NotResumable
        There is none, it cannot be read, or an option of now is not as it was.
    """
    folder = folder.expanduser().resolve()
    path = folder / 'config' / FILE_NAME
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
        if content['format'] != _FORMAT:
            msg = f'it has format {content["format"]}, this version reads {_FORMAT}'
            raise ValueError(msg)
        asked, command = options_from(content['options']), tuple(content['command'])
    except OSError as error:
        msg = f'{folder} holds no run to go on with: {path} cannot be read: {error.strerror}'
        raise NotResumable(msg) from None
    except (ValueError, KeyError, TypeError) as error:
        msg = f'the run in {folder} cannot be gone on with: {path}: {error}'
        raise NotResumable(msg) from None
    differing = conflicts(asked, given)
    out = given.get('out')
    if out is not None and out.expanduser().resolve() != folder:
        differing.append(f'--out is {out}')
    if differing:
        msg = (
            f'a run goes on as it was begun, but {"; ".join(differing)}: leave that away, '
            'or begin another run with another --out'
        )
        raise NotResumable(msg)
    changed = {key: value for key, value in given.items() if _is_free(key)}
    return KeptRun(folder, replace(asked, **changed), command)


def _is_free(key: str) -> bool:
    declared = RunOptions.__dataclass_fields__.get(key)
    return declared is not None and declared.metadata['option'].resumable


def _with_files(options: RunOptions, place: Callable[[str, Path], Path]) -> RunOptions:
    """``options`` with each file that they name at the place that ``place`` gives it, by key."""
    changed: dict[str, Any] = {'boxes': with_path(options.boxes, lambda path: place('boxes', path))}
    kind, _, rest = options.arrivals.partition(':')
    if kind == 'recorded':
        changed['arrivals'] = f'{kind}:{place("arrivals", Path(rest))}'
    for key in ('layout', 'tuned', 'start_bins'):
        path = getattr(options, key)
        if path is not None:
            changed[key] = place(key, path)
    return replace(options, **changed)
