#!/bin/sh
# Resolve the newest versions of everything, for the oldest Python, into constraints.txt: no addresses.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet uv
{
  echo "# Versions with which everything was tested; written by 'make constraints'."
  {
    printf '%s\n' '.[bench,mutation,release,web]' hatchling editables uv
    for plug_in in plugins/*/pyproject.toml; do echo "./$(dirname "$plug_in")[dev]"; done
  } | "$folder/venv/bin/uv" pip compile --quiet --python-version 3.11 --no-annotate --no-header -o "$folder/all" -
  grep -v '^\(\.\|visualhfsm\|file:\)' "$folder/all"
} >"$folder/constraints.txt"
mv "$folder/constraints.txt" constraints.txt
