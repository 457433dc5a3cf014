#!/bin/sh
# What "make install" does: touchd in a virtual environment at $PREFIX, its config, and its units for systemd.
#   PREFIX=/opt/touchd      where the environment goes
#   PYTHON=/usr/bin/python3 the Python that it is made of
#   DESTDIR=                a folder to install under, for packagers; the running system is left alone then
# pip's own variables hold: PIP_NO_INDEX=1 PIP_FIND_LINKS=FOLDER installs from a folder of wheels, without a network.
set -eu

source=$(cd "$(dirname "$0")/.." && pwd)
PREFIX=${PREFIX:-/opt/touchd}
PYTHON=${PYTHON:-/usr/bin/python3}
DESTDIR=${DESTDIR:-}
etc=$DESTDIR/etc/touchd
units=$DESTDIR/usr/local/lib/systemd/system
sysusers=$DESTDIR/usr/local/lib/sysusers.d
udev=$DESTDIR/etc/udev/rules.d
bin=$DESTDIR/usr/local/bin
share=$DESTDIR$PREFIX/share
venv=$DESTDIR$PREFIX/venv
export PIP_DISABLE_PIP_VERSION_CHECK=1

fail() {
  echo "make install: $1" >&2
  exit 1
}

check() {
  case $PREFIX in
    /*[!/]*) ;;
    *) fail "PREFIX must be a folder of its own from the root on, such as /opt/touchd; found '$PREFIX'" ;;
  esac
  case $PREFIX in
    *[!A-Za-z0-9/._-]*) fail "PREFIX may have letters, digits and /._- only; found '$PREFIX'" ;;
  esac
  [ -n "$DESTDIR" ] || [ "$(id -u)" -eq 0 ] || fail "this needs root: sudo make install"
  [ ! -e "$DESTDIR$PREFIX" ] || [ -e "$share/touchd.yaml" ] ||
    fail "$DESTDIR$PREFIX is there and is not touchd's: name another folder with make install PREFIX=FOLDER"
  command -v "$PYTHON" >/dev/null || fail "$PYTHON is missing: apt-get install python3 python3-venv"
  "$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "$("$PYTHON" --version) is too old, touchd needs Python 3.11 or later: name one with PYTHON=/path/to/python3"
  "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null ||
    fail "$PYTHON cannot make virtual environments: apt-get install python3-venv"
}

systemd_runs() {
  [ -z "$DESTDIR" ] && [ -d /run/systemd/system ]
}

# All is fetched and built before anything is touched: an upgrade that fails leaves what was installed.
fetch() {
  wheels=$(mktemp -d)
  trap 'rm -rf "$wheels"' EXIT
  "$PYTHON" -m venv "$wheels/venv"
  "$wheels/venv/bin/pip" wheel --quiet --wheel-dir "$wheels" "$source"
}

install_program() {
  "$PYTHON" -m venv --clear --without-pip "$venv"
  "$wheels/venv/bin/pip" --python "$venv/bin/python" install --quiet --no-compile --no-index --find-links "$wheels" \
    "$wheels"/touchd-*.whl
  # The service may not write here, so bytecode is made now, with the paths that will hold.
  "$venv/bin/python" -m compileall -q -s "$DESTDIR" "$venv/lib"
  if [ -n "$DESTDIR" ]; then
    grep -rlIF "$venv" "$venv/bin" "$venv/pyvenv.cfg" | xargs sed -i "s|$venv|$PREFIX/venv|g"
  fi
  mkdir -p "$bin"
  ln -sf "$PREFIX/venv/bin/touchd" "$bin/touchd"
}

# An edited config stays. What was installed before tells an edited one from one to be replaced.
install_config() {
  edited=
  if [ -e "$etc/touchd.yaml" ] && ! cmp -s "$etc/touchd.yaml" "$share/touchd.yaml"; then
    edited=yes
    echo "kept: $etc/touchd.yaml has been edited; the new default is $share/touchd.yaml"
  fi
  install -d -m 755 "$etc" "$share"
  install -m 644 "$source/config/touchd.yaml" "$source/config/touchd.schema.json" "$source/README.md" "$share"
  [ -n "$edited" ] || install -m 644 "$share/touchd.yaml" "$etc"
  install -m 644 "$share/touchd.schema.json" "$etc"
}

install_units() {
  install -d -m 755 "$units" "$sysusers" "$udev"
  for unit in touchd.service touchd@.service; do
    sed "s|/opt/touchd|$PREFIX|g" "$source/systemd/$unit" >"$units/$unit"
    chmod 644 "$units/$unit"
  done
  install -m 644 "$source/systemd/touchd.sysusers.conf" "$sysusers/touchd.conf"
  install -m 644 "$source/systemd/60-touchd.rules" "$udev"
}

# What runs goes on with the new program.
tell_systemd() {
  systemd-sysusers "$sysusers/touchd.conf"
  systemctl daemon-reload
  udevadm control --reload 2>/dev/null || true # there is no udev in a container
  udevadm trigger --subsystem-match=usb --action=change 2>/dev/null || true
  systemctl try-restart touchd.service 'touchd@*.service'
}

check
fetch
install_config
install_program
install_units
if systemd_runs; then tell_systemd; fi
echo "touchd is installed in $DESTDIR$PREFIX. Next:"
echo "  1. edit $etc/touchd.yaml, and check it: touchd check-config --config /etc/touchd/touchd.yaml"
echo "  2. start it now and at every boot:  systemctl enable --now touchd"
echo "  3. see how it fares:                systemctl status touchd"
