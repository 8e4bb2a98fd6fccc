"""Commands that the pages show are commands: every option exists, every script is there."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from pack_cell.cli import build_parser
from pack_cell.options.run_options import run_options

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    ROOT / 'README.md',
    ROOT / 'CONTRIBUTING.md',
    *sorted(ROOT.glob('docs/**/*.md')),
    *sorted(ROOT.glob('packages/*/README.md')),
]
VERBS = ('demo', 'run', 'view', 'report', 'compare', 'bench', 'tune', 'layout', 'journal')

#: What stands for something of the reader's own, and what may stand there in a test.
PLACEHOLDERS = {'S': '2', 'K': '2', 'N': '1', 'RULE': 'largest', 'NAME': 'ur10e'}

#: What an option that names files of the reader's own is given in a test.
FILES = {
    '--boxes': 'cartons',
    '--layout': '',
    '--resume': 'run',
    '--start-bins': '',
    '--tuned': '',
    '--algorithm': 'mpack_lite',
    '--algorithms': 'mpack_lite',
    '--arm': 'timed',
    '--selection': 'largest',
}


def with_known_files(words: list[str]) -> list[str]:
    """``words`` with something that is there for every file that is not."""
    known = list(words)
    for at, (flag, value) in enumerate(pairwise(words), start=1):
        if flag in FILES and re.search(r'\.|FILE|FOLDER|RULE|/', value):
            known[at] = FILES[flag]
    return [PLACEHOLDERS.get(word, word) for word in known]


def commands(page: Path) -> Iterator[list[str]]:
    """The words of each command in the page's blocks of shell code and in its text."""
    text = page.read_text()
    blocks = re.findall(r'(?ms)^```bash\n(.*?)^```', text)
    lines = '\n'.join(blocks).replace('\\\n', ' ').splitlines()
    lines += re.findall(r'`(\./cell [^`]+|python [\w/]+\.py[^`]*)`', text)
    for line in lines:
        words = shlex.split(line.split(' > ')[0], comments=True)
        if words:
            yield with_known_files(words)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_commands_of_a_page_can_be_given(page: Path) -> None:
    parser = build_parser()
    for words in commands(page):
        if words[0] == './cell' and words[1:2] and words[1] in VERBS and '--help' not in words:
            options = parser.parse_args(words[1:])
            if options.verb == 'run':
                run_options(vars(options))
        scripts = [word for word in words if word.endswith('.py') and '/' in word]
        if 'python' in words[:2]:
            assert all((ROOT / script).exists() for script in scripts), words


def test_cell_knows_every_verb_of_the_command_line() -> None:
    listed = re.findall(r'(?m)^  ([a-z0-9]+)  ', (ROOT / 'cell').read_text())
    (verbs,) = (action for action in build_parser()._actions if action.dest == 'verb')
    assert set(verbs.choices or ()) <= set(listed)
