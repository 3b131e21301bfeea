#!/bin/sh
# Resolve the newest versions of everything into constraints.txt: names and versions only, no addresses.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --editable '.[bench,mutation,naoqi,release,web]' hatchling editables uv
{
  echo "# Versions with which everything was tested; written by 'make constraints'."
  "$folder/venv/bin/python" -m pip freeze --exclude-editable | grep -v -e '@' -e '^-e' | LC_ALL=C sort -f
} >constraints.txt
