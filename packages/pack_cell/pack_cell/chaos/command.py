"""``cell chaos``: faults from outside against the nodes and against a running cell."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pack_cell.options.parsers import NumberRange, whole
from pack_cell.report.accounts import account_text
from pack_cell.running.ros_domain import DomainTaken, hold_domain
from pack_msgs_py.wording import how_many

if TYPE_CHECKING:
    from pack_cell.chaos.campaign import Campaign
    from pack_cell.chaos.lone_node import LoneNode

EXIT_OK, EXIT_WRONG, EXIT_USAGE = 0, 1, 2
#: Share of the hostile messages that nodes alone are told, who believe them.
ALONE = 0.75
TIMED = ('--arm', 'timed', '--speed', '6', '--algorithm', 'mpack_lite', '--faults', 'all=0.01')
PHYSICS = ('--speed', '0', '--algorithm', 'mpack_lite')


def add_chaos(verbs: Any) -> None:  # noqa: ANN401 - argparse does not name its subparsers
    """Add ``cell chaos`` to the command line."""
    parser = verbs.add_parser(
        'chaos',
        help='faults from outside against a running cell, and a check of its books',
        description='Tells each node alone, which has to believe it, hostile things in every field '
        'of every message, service, action and parameter. Then runs a cell and kills nodes, halts '
        'them, cuts all of it, plays messages again, starts second nodes. At last checks its books '
        'without the code that wrote them. Exit code 0: no node died of a message, the cell went '
        'on after each fault, and every box is in one place; 1: not so; 2: wrong option.',
    )
    parser.add_argument(
        '--minutes', type=NumberRange(0.0, 10_000.0, 'minutes'), default=5.0,
        metavar='N', help='how long the cell is under fire (default 5)',
    )  # fmt: skip
    parser.add_argument(
        '--messages', type=whole(0, 10_000_000), default=2000, metavar='N',
        help='hostile messages in all (default 2000)',
    )  # fmt: skip
    parser.add_argument(
        '--physics', action='store_true', help='the arm in physics; else one that only takes time'
    )
    parser.add_argument(
        '--seed', type=whole(0, 2**31 - 1), default=1, metavar='N',
        help='of the chances (default 1)',
    )  # fmt: skip
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help='folder for logs, books and results '
        '(default runs/chaos-TIME)',
    )  # fmt: skip


def run_chaos(arguments: argparse.Namespace) -> int:
    """Do it; return the exit code."""
    name = f'chaos-{datetime.now().strftime("%Y%m%d-%H%M%S")}'
    folder = (arguments.out or Path('runs') / name).resolve()
    if folder.exists() and any(folder.iterdir()):
        print(f'cell chaos: {folder} is not empty; choose another --out', file=sys.stderr)
        return EXIT_USAGE
    try:
        lock = hold_domain()
    except (DomainTaken, ValueError) as error:
        print(f'cell chaos: {error}', file=sys.stderr)
        return EXIT_USAGE
    domain = lock.number
    began_s = time.monotonic()
    try:
        alone = _alone(arguments, folder, domain)
    finally:
        lock.release()
    campaign, books = _under_fire(arguments, folder, domain)
    wrong = [*(text for node in alone for text in node.wrong), *campaign.wrong, *books['wrong']]
    _tell(alone, campaign, books, wrong)
    results = {
        'seconds': round(time.monotonic() - began_s, 1),
        'options': {key: str(value) for key, value in vars(arguments).items()},
        'alone': [node.__dict__ for node in alone],
        'faults': [fault.__dict__ for fault in campaign.faults],
        'messages_at_the_cell': campaign.messages,
        'books': books,
        'wrong': wrong,
    }
    (folder / 'chaos.json').write_text(json.dumps(results, indent=2) + '\n')
    print(f'written to {folder}')
    return EXIT_WRONG if wrong else EXIT_OK


def _alone(arguments: argparse.Namespace, folder: Path, domain: int) -> list[LoneNode]:
    from pack_cell.chaos.lone_node import PARAMETERS, attack_alone

    share = round(ALONE * arguments.messages / len(PARAMETERS))
    nodes = []
    for name in PARAMETERS if share else ():
        print(f'{name} alone is told {share} hostile things', flush=True)
        nodes.append(attack_alone(name, share, arguments.seed, folder / 'alone', domain))
    return nodes


def _under_fire(
    arguments: argparse.Namespace, folder: Path, domain: int
) -> tuple[Campaign, dict[str, Any]]:
    from pack_cell.chaos.book_checker import check_books, count_alarms, count_places
    from pack_cell.chaos.campaign import Campaign, run_campaign
    from pack_cell.chaos.cell_at_hand import CellAtHand
    from pack_cell.ros.attacker import SteppedAttacker
    from pack_cell.ros.executables import NODES

    left = arguments.messages - round(ALONE * arguments.messages)
    arm = PHYSICS if arguments.physics else TIMED
    given = [*arm, '--respawn', '--count', '1000000', '--stall-timeout', '600', '--quiet']
    cell = CellAtHand(folder / 'run', given, domain)
    attacker = SteppedAttacker(arguments.seed, domain)
    cell.start()
    try:
        if cell.seconds_to_next() is None:
            campaign = Campaign(wrong=[f'the cell places no box\n{cell.screen()}'])
        elif unknown := [node for node in (*NODES, 'recorder') if not attacker.get_to_know(node)]:
            campaign = Campaign(wrong=[f'the cell runs, and {unknown} tell nothing of themselves'])
        else:
            campaign = run_campaign(
                cell,
                attacker,
                minutes=arguments.minutes,
                messages=left,
                seed=arguments.seed,
                domain=domain,
                say=lambda text: print(f'  {text}', flush=True),
            )
    finally:
        attacker.close()
        code = cell.end()
    wrong = check_books(cell.folder, 0, ended=False)
    if code != 0:
        wrong.append(f'the run ended with {code}\n{cell.screen()}')
    summary_file = cell.folder / 'summary.json'
    summary = json.loads(summary_file.read_text()) if summary_file.exists() else {}
    if not (summary.get('accounts') or {}).get('sum_is_right'):
        wrong.append(f'summary: accounts are {summary.get("accounts")}')
    for key in ('unaccounted', 'rule_violations', 'mis_sorts'):
        if summary.get(key):
            wrong.append(f'summary: {key} is {summary[key]}: {summary["problems"]}')
    return campaign, {
        'accounts': summary.get('accounts'),
        'places': dict(count_places(cell.folder)),
        'alarms': dict(count_alarms(cell.folder)),
        'wrong': wrong,
    }


def _tell(
    alone: list[LoneNode], campaign: Campaign, books: dict[str, Any], wrong: list[str]
) -> None:
    told = Counter[str]()
    for node in alone:
        told.update(node.sent)
    kinds = ', '.join(f'{number} {kind}' for kind, number in told.items())
    print(f'nodes alone were told {told.total()} hostile things: {kinds}')
    faults = how_many(len(campaign.faults), 'fault')
    print(f'the cell was told {campaign.messages} of them; {faults} of other kinds')
    for kind, number, median_s, worst_s in campaign.table():
        often = f'{kind:<18} {how_many(number, "time"):>10}'
        print(f'  {often}, goes on in {median_s:.1f} s, worst {worst_s:.1f} s')
    places = ', '.join(f'{number} {place}' for place, number in books['places'].items())
    print(f'boxes: {account_text(books["accounts"])}; by the books: {places}')
    alarms = ', '.join(f'{number} {code}' for code, number in sorted(books['alarms'].items()))
    print(f'alarms and warnings: {alarms or "none"}')
    print('nothing was wrong' if not wrong else 'WRONG:')
    for text in wrong:
        print(f'  {text}')
