#!/bin/sh
# Create the virtual environment: create_venv.sh PYTHON FOLDER
set -eu
python=$1
folder=$2

if ! command -v "$python" >/dev/null 2>&1; then
  echo "error: $python not found; install Python 3.11 or newer, or name one: make PYTHON=python3.12" >&2
  exit 1
fi
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
  echo "error: $("$python" --version) is too old; VisualHFSM needs Python 3.11 or newer: make PYTHON=python3.11" >&2
  exit 1
fi
# Debian keeps ensurepip in a separate package.
if ! "$python" -c 'import ensurepip' >/dev/null 2>&1; then
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    sh "$(dirname "$0")/apt_install.sh" python3-venv
  else
    echo "error: $python cannot create virtual environments; type: sudo apt-get install python3-venv" >&2
    exit 1
  fi
fi
"$python" -m venv "$folder"
"$folder/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check --constraint constraints.txt uv ||
  echo "warning: uv cannot be installed; pip takes its place, which takes a minute longer" >&2
