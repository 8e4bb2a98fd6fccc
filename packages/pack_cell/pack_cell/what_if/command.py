"""``cell compare``: pack every combination, write the page, say what to take."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence

from pack_cell.options.usual import USUAL_FACES
from pack_cell.what_if.options import NO_ARM, combinations_of
from pack_msgs_py.wording import how_many

EXIT_OK, EXIT_FAULT, EXIT_USAGE, EXIT_INTERRUPTED = 0, 1, 2, 130


def run_compare(arguments: argparse.Namespace, given: Sequence[str] = ()) -> int:
    """Do what ``arguments`` say; ``given`` is the command line, for the page."""
    from pack_cell.what_if.outcomes import ArmRunFailed

    try:
        return _run(arguments, shlex.join(['./cell', *given]))
    except (ValueError, OSError) as error:
        print(f'cell compare: {error}', file=sys.stderr)
        return EXIT_USAGE
    except ArmRunFailed as error:
        print(f'cell compare: {error}', file=sys.stderr)
        return EXIT_FAULT
    except KeyboardInterrupt:
        print('cell compare: interrupted', file=sys.stderr)
        return EXIT_INTERRUPTED


def _run(arguments: argparse.Namespace, command: str) -> int:
    from pack_cell.what_if.outcomes import source_of, with_arm, without_robot
    from pack_cell.what_if.page import compare_page, write_outcomes
    from pack_cell.what_if.recommendation import recommendations

    if getattr(arguments, 'order_by', '') and arguments.arm == NO_ARM:
        msg = '--order-by needs --arm timed or physics: without an arm all orders share the bins'
        raise ValueError(msg)
    arguments.grasp_faces = arguments.grasp_faces or USUAL_FACES[arguments.profile]
    combinations = combinations_of(arguments)
    source = source_of(arguments)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    done = 0

    def look(text: str) -> None:
        nonlocal done
        done += 1
        print(f'{done}/{len(combinations)} {text}', file=sys.stderr)

    pack = without_robot if arguments.arm == NO_ARM else with_arm
    outcomes = list(pack(combinations, arguments, look))
    about = [
        f'{how_many(len(source.boxes), "box")} ({source.name}), '
        + ('1 order.' if arguments.orders == 1 else f'{arguments.orders} orders each.'),
        'Packed without a robot: what an arm cannot reach in time is not left out here.'
        if arguments.arm == NO_ARM
        else f'Run with the {arguments.arm} arm, as cell run does; the times are of the robot.',
        f'Profile {arguments.profile}, boxes taken by: {arguments.grasp_faces}.',
        *(f'Left out: {text}' for _, text in source.rejected[:10]),
    ]
    page = compare_page(outcomes, arguments.most_by_hand, command, about)
    arguments.out.write_text(page, encoding='utf-8')
    table = arguments.out.with_suffix('.csv')
    write_outcomes(table, outcomes)
    for sentence in recommendations(outcomes, arguments.most_by_hand):
        print(sentence)
    print(f'wrote {arguments.out} and {table}', file=sys.stderr)
    return EXIT_OK
