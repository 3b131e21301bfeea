#!/bin/sh
# Make sure that MuJoCo finds a GL library to render with: system_packages.sh PYTHON
# Without one everything but the cameras works, so this never stops what called it.
set -eu
python=$1

can_render() {
  "$python" -c 'import ctypes; ctypes.CDLL("libEGL.so.1"); ctypes.CDLL("libGL.so.1"); ctypes.CDLL("libEGL_mesa.so.0")' >/dev/null 2>&1
}

packages="libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libopengl0"
can_render && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
  echo "installing the GL library for the simulated cameras: $packages"
  # shellcheck disable=SC2086  # one word a package
  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $packages >/dev/null ||
    echo "warning: apt-get failed; the simulated cameras will not work until it succeeds" >&2
else
  echo "warning: no GL library, so the simulated cameras will not work; type: sudo apt-get install $packages" >&2
fi
