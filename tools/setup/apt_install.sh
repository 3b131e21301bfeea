#!/bin/sh
# Install Debian packages as root, one call after the other, since apt refuses two at once: apt_install.sh PACKAGE...
exec flock "${TMPDIR:-/tmp}/visualhfsm-apt.lock" sh -ec '
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "$@" >/dev/null
' sh "$@"
