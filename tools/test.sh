#!/bin/bash
# Called by `./cell test` in the environment of the cell: lint, type check, then the tests,
# so that pytest's closing line comes last. Everything runs even when something before it failed.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fast='' arguments=() failed=()
for argument in "$@"; do
  if [[ $argument == --fast ]]; then
    fast=yes
  else
    arguments+=("$argument")
  fi
done

if [[ $fast ]]; then
  arguments+=(-m 'not slow')
else
  python -m ruff check . || failed+=('ruff')
  python -m mypy || failed+=('mypy')
fi
if (( ${#failed[@]} )); then
  echo "failed before the tests: ${failed[*]}"
fi
status=0
python -m pytest ${arguments[@]+"${arguments[@]}"} || status=$?
if (( ${#failed[@]} )); then
  echo "also failed, see above: ${failed[*]}" >&2
  (( status )) || status=1
fi
exit "$status"
