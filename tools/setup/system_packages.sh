#!/bin/sh
# Make sure that this machine has what is no Python package: system_packages.sh PYTHON gl|chromium|bubblewrap|node...
#   gl        the library with which MuJoCo renders; without it everything but the cameras works
#   chromium  the browser in which the editor's page is tested; without it those tests are skipped
#   bubblewrap  the walls around submissions of a class; without it their tests fail
#   node      Node.js and npm, by which the page is checked; without them that is left out
# So this never stops what called it.
set -eu
python=$1
shift

can_render() {
  "$python" -c 'import ctypes; ctypes.CDLL("libEGL.so.1"); ctypes.CDLL("libGL.so.1"); ctypes.CDLL("libEGL_mesa.so.0")' >/dev/null 2>&1
}

has_chromium() {
  [ -n "${CHROMIUM:-}" ] && return
  for name in chromium-headless-shell chromium chromium-browser; do
    command -v "$name" >/dev/null 2>&1 && return
  done
  return 1
}

# install_packages WHAT CONSEQUENCE PACKAGE...
install_packages() {
  what=$1 consequence=$2
  shift 2
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "installing $what: $*"
    sh "$(dirname "$0")/apt_install.sh" "$@" || echo "warning: apt-get failed; $consequence until it succeeds" >&2
  else
    echo "warning: $what is missing, so $consequence; type: sudo apt-get install $*" >&2
  fi
}

for wanted in "$@"; do
  case $wanted in
    gl) can_render || install_packages "the GL library" "the simulated cameras do not work" \
      libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0 ;;
    # Debian has one without windows, which takes a quarter less time.
    chromium) has_chromium || install_packages "the browser Chromium" "the tests of the editor's page are skipped" \
      "$(grep -qs '^ID=debian' /etc/os-release && echo chromium-headless-shell || echo chromium)" \
      fonts-dejavu-core ;;
    bubblewrap) command -v bwrap >/dev/null 2>&1 ||
      install_packages "bubblewrap" "submissions are not contained, and their tests fail" bubblewrap ;;
    node) command -v npm >/dev/null 2>&1 || install_packages "Node.js" "the editor's page is not checked" nodejs npm ;;
    *) echo "system_packages.sh: unknown: $wanted" >&2 && exit 2 ;;
  esac
done
