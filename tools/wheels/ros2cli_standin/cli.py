"""The ``ros2`` command line: which commands and verbs there are, and how they end."""

from __future__ import annotations

import argparse
import io
import signal
import sys
from collections.abc import Callable, Sequence

from rclpy.executors import ExternalShutdownException

from ros2cli_standin import (
    actions,
    echo,
    hz,
    interfaces,
    nodes,
    packages,
    params,
    services,
    topics,
)

#: A verb adds its arguments to a parser and names the function that does it.
Verb = Callable[[argparse.ArgumentParser], None]

VERBS: dict[str, dict[str, Verb]] = {
    'action': {'list': actions.add_list},
    'interface': {'list': interfaces.add_list, 'show': interfaces.add_show},
    'node': {'info': nodes.add_info, 'list': nodes.add_list},
    'param': {'get': params.add_get, 'list': params.add_list, 'set': params.add_set},
    'pkg': {
        'executables': packages.add_executables,
        'list': packages.add_list,
        'prefix': packages.add_prefix,
    },
    'service': {
        'call': services.add_call,
        'list': services.add_list,
        'type': services.add_type,
    },
    'topic': {
        'echo': echo.add_echo,
        'hz': hz.add_hz,
        'info': topics.add_info,
        'list': topics.add_list,
        'type': topics.add_type,
    },
}

#: What ros2cli has and the stand-in does not, with what to do instead.
ELSEWHERE = {
    'launch': "'./cell run' starts the whole cell, 'ros2 run PACKAGE NODE' a single node",
    'bag': "'./cell run' records every run in runs/",
}

DESCRIPTION = (
    'ros2 is an extensible command-line tool for ROS 2.\n'
    'This is the stand-in of the packing cell: the commands below, as in ros2cli.'
)


def build_parser() -> argparse.ArgumentParser:
    """The parser of every command and verb."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='ros2', description=DESCRIPTION, formatter_class=raw)
    commands = parser.add_subparsers(
        title='Commands', metavar='Call `ros2 <command> -h` for more detailed usage.'
    )
    for command, verbs in sorted({**VERBS, 'run': {}}.items()):
        if command == 'run':
            text = 'Run a package specific executable'
            packages.add_run(commands.add_parser('run', help=text, description=text))
            continue
        text = f'Various {command} related sub-commands'
        one = commands.add_parser(command, help=text, description=text, formatter_class=raw)
        one.set_defaults(run=None, help_parser=one)
        of_one = one.add_subparsers(
            title='Commands', metavar=f'Call `ros2 {command} <command> -h` for more detailed usage.'
        )
        for name, add in verbs.items():
            summary = (add.__doc__ or '').splitlines()[0]
            add(of_one.add_parser(name, help=summary, description=summary, formatter_class=raw))
    return parser


def main(arguments: Sequence[str] | None = None) -> int | str | None:
    """Run one command; return what ``sys.exit`` takes: a code, or what went wrong."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given and given[0] in ELSEWHERE:
        print(
            f"ros2: '{given[0]}' is not in this stand-in and needs a ROS 2 installation; "
            f'{ELSEWHERE[given[0]]}',
            file=sys.stderr,
        )
        return 2
    parser = build_parser()
    parsed = parser.parse_args(given)
    run = getattr(parsed, 'run', None)
    if run is None:
        getattr(parsed, 'help_parser', parser).print_help()
        return 0
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    try:
        result: int | str | None = run(parsed)
    except KeyboardInterrupt:
        return int(signal.SIGINT)
    except ExternalShutdownException:
        return int(signal.SIGTERM)
    except BrokenPipeError:
        # `ros2 topic echo ... | head`: nobody reads on.
        sys.stderr.close()
        return 1
    except RuntimeError as error:
        return str(error)
    return result
