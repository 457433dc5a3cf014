#!/bin/sh
# What "make uninstall" does: stops touchd and removes all of it, state and user too. Only an edited config survives, in
# an archive that is named. PREFIX and DESTDIR are as in install.sh.
set -eu

PREFIX=${PREFIX:-/opt/touchd}
DESTDIR=${DESTDIR:-}
etc=$DESTDIR/etc/touchd
dropins=$DESTDIR/etc/systemd/system
share=$DESTDIR$PREFIX/share

if [ ! -e "$share/touchd.yaml" ]; then
  echo "make uninstall: there is no touchd in $DESTDIR$PREFIX; name its folder with make uninstall PREFIX=FOLDER" >&2
  exit 1
fi
if [ -z "$DESTDIR" ] && [ "$(id -u)" -ne 0 ]; then
  echo "make uninstall: this needs root: sudo make uninstall" >&2
  exit 1
fi

# Enabled instances need not be running, nor the running ones be enabled.
instances() {
  systemctl list-units --all --plain --no-legend --full 'touchd@*.service' | cut -d ' ' -f 1
  find "$dropins" -path '*.wants/touchd@*.service' -exec basename {} \; 2>/dev/null
}

stop_service() {
  # shellcheck disable=SC2046  # each name is a word
  systemctl disable --now --quiet touchd.service $(instances | sort -u) 2>/dev/null || true
  # shellcheck disable=SC2046
  systemctl stop touchd.service $(instances | sort -u) 2>/dev/null || true
}

# Prints the names, below the root, of the config files and unit drop-ins that are not as installed.
edited() {
  for file in "$etc"/*; do
    cmp -s "$file" "$share/$(basename "$file")" || echo "${file#"$DESTDIR"/}"
  done
  find "$dropins" -path '*/touchd*.service.d/*' 2>/dev/null | sed "s|^$DESTDIR/||"
}

save_edited() {
  [ -n "$(edited)" ] || return 0
  backup=$DESTDIR/var/backups/touchd-config-$(date +%Y%m%d-%H%M%S).tar.gz
  mkdir -p "$DESTDIR/var/backups"
  edited | tar --create --gzip --file "$backup" --directory "$DESTDIR/" --files-from -
  echo "Your edited config was saved to $backup."
}

remove_files() {
  rm -rf "$etc" "$DESTDIR/var/lib/touchd" "$DESTDIR/run/touchd" "$DESTDIR"/run/touchd-* "$DESTDIR$PREFIX"
  rm -rf "$dropins/touchd.service.d" "$dropins"/touchd@*.service.d
  rm -f "$DESTDIR/usr/local/lib/systemd/system/touchd.service" "$DESTDIR/usr/local/lib/systemd/system/touchd@.service"
  rm -f "$DESTDIR/usr/local/lib/sysusers.d/touchd.conf" "$DESTDIR/etc/udev/rules.d/60-touchd.rules"
  if [ "$(readlink "$DESTDIR/usr/local/bin/touchd")" = "$PREFIX/venv/bin/touchd" ]; then
    rm "$DESTDIR/usr/local/bin/touchd"
  fi
  for folder in systemd/system systemd sysusers.d; do
    rmdir "$DESTDIR/usr/local/lib/$folder" 2>/dev/null || true
  done
}

forget_user() {
  if getent passwd touchd >/dev/null; then userdel touchd; fi
  if getent group touchd >/dev/null; then groupdel touchd; fi
}

systemd_runs=
[ -n "$DESTDIR" ] || [ ! -d /run/systemd/system ] || systemd_runs=yes
if [ -n "$systemd_runs" ]; then stop_service; fi
save_edited
remove_files
[ -n "$DESTDIR" ] || forget_user
if [ -n "$systemd_runs" ]; then
  systemctl daemon-reload
  systemctl reset-failed 'touchd*' 2>/dev/null || true
  udevadm control --reload 2>/dev/null || true
fi
echo "touchd is uninstalled."
