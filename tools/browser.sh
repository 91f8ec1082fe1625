#!/bin/sh
# Looks for a Chromium for the tests in the browser. Where there is none, installs Debian's as root; else says what
# to do, and the tests of the page skip themselves.
#
# Usage: tools/browser.sh
set -eu

say() { printf '%s\n' "$*" >&2; }

found() {
    if [ -n "${KEMPELEN_CHROMIUM:-}" ]; then
        command -v "$KEMPELEN_CHROMIUM" >/dev/null && return
        say "KEMPELEN_CHROMIUM is $KEMPELEN_CHROMIUM, and there is no such program."
        exit 1
    fi
    for name in chromium chromium-browser google-chrome; do
        if command -v "$name" >/dev/null; then return; fi
    done
    return 1
}

if found; then exit; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    say "Installing chromium for the tests in the browser ..."
    if apt-get update -q >&2 &&
        DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends chromium >&2 && found; then
        exit
    fi
    say "It could not be installed."
fi
say "There is no Chromium here, so the tests in the browser are skipped."
say "Install it (Debian: sudo apt install chromium), or name one: make test KEMPELEN_CHROMIUM=/path/to/chromium"
