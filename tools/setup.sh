#!/bin/sh
# Makes the virtual environment .venv and installs into it what requirements/<name>.txt pins, by hash, and
# Kempelen itself. Needs Python 3.11 or newer and the package index; uv is fetched through pip where it is missing.
#
# Usage: tools/setup.sh run|dev
set -eu

name=${1:?"usage: tools/setup.sh run|dev"}
venv=.venv
cd "$(dirname "$0")/.."

export UV_SYSTEM_CERTS=1 UV_NATIVE_TLS=1  # trust what the system trusts, as pip does

say() { printf '%s\n' "$*" >&2; }

find_python() {
    for candidate in ${PYTHON:-} python3.11 python3.12 python3.13 python3 python; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            command -v "$candidate"
            return
        fi
    done
    say "Kempelen needs Python 3.11 or newer, and there is none here."
    say "Install it (Debian, Ubuntu: sudo apt install python3), or name it: make setup PYTHON=/path/to/python3"
    exit 1
}

works() { "$@" >/dev/null 2>&1; }

# Debian ships Python without the part that makes virtual environments with pip.
require_ensurepip() {
    if works "$1" -c 'import ensurepip, venv'; then return; fi
    if [ "$(id -u)" = 0 ] && works command -v apt-get; then
        say "Installing python3-venv, which Debian keeps apart from Python ..."
        apt-get update -q >&2
        version=$("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        DEBIAN_FRONTEND=noninteractive apt-get install -q -y "python$version-venv" >&2 ||
            DEBIAN_FRONTEND=noninteractive apt-get install -q -y python3-venv >&2
        if works "$1" -c 'import ensurepip, venv'; then return; fi
    fi
    say "This Python cannot make virtual environments: its parts 'venv' and 'ensurepip' are missing."
    say "Install them (Debian, Ubuntu: sudo apt install python3-venv) and run make again."
    exit 1
}

make_venv() {
    python=$(find_python)
    if works uv --version; then
        uv venv --quiet --no-python-downloads --clear --python "$python" "$venv"
    else
        require_ensurepip "$python"
        "$python" -m venv --clear "$venv"
    fi
}

install() {
    if works uv --version; then
        uv pip install --quiet --python "$venv/bin/python" "$@"
        return
    fi
    if ! works "$venv/bin/python" -m uv --version; then
        pip install -r requirements/build.txt
    fi
    # uv does not read pip's settings; where the index is known to pip alone, pip does the same, slower.
    "$venv/bin/python" -m uv pip install --quiet --python "$venv/bin/python" "$@" || pip install "$@"
}

pip() { "$venv/bin/python" -m pip --disable-pip-version-check --quiet "$@"; }

if ! works "$venv/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    say "Making $venv ..."
    make_venv
fi
say "Installing requirements/$name.txt ..."
install --require-hashes -r requirements/build.txt -r "requirements/$name.txt"
install --no-deps --no-build-isolation -e .
