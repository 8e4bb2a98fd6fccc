#!/bin/bash
# Called by `./cell test` in the environment of the cell: lint, format, type check, then the tests,
# so that pytest's closing line comes last. Everything runs even when something before it failed.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fast='' given=() failed=()
for argument in "$@"; do
  if [[ $argument == --fast ]]; then
    fast=yes
  else
    given+=("$argument")
  fi
done

# Tests that wait for nodes leave a core idle, so there is one more worker than cores; `-n 0` runs
# all of them in one process.
export PYTEST_XDIST_AUTO_NUM_WORKERS=${PYTEST_XDIST_AUTO_NUM_WORKERS:-$(($(nproc) + 1))}
options=(-n auto --maxprocesses 8 --dist worksteal -r fER)
if [[ $fast ]]; then
  options+=(-m 'not (cell or ros or physics or slow)')
else
  python -m ruff check . || failed+=('ruff')
  python -m ruff format --check --quiet . || failed+=('ruff format')
  python -m mypy || failed+=('mypy')
  options+=(--durations 20)
  # Of a part of the tests the coverage says nothing.
  (( ${#given[@]} )) || options+=(--cov --cov-report=)
fi
if (( ${#failed[@]} )); then
  echo "failed before the tests: ${failed[*]}"
fi
status=0
python -m pytest "${options[@]}" ${given[@]+"${given[@]}"} || status=$?
if (( ${#failed[@]} )); then
  echo "also failed, see above: ${failed[*]}" >&2
  (( status )) || status=1
fi
exit "$status"
