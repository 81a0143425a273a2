# Shared by the scripts beside this file: messages, and installing only what is missing.
# shellcheck shell=bash

# shellcheck disable=SC2034 # for the scripts that read this file
readonly PYTHON_ENV=target/python
# shellcheck disable=SC2034
readonly BLENDER_ENV=target/blender
readonly UV_VERSION=0.13.9

# Mesa complains on every start where this is unset, as in containers, though nothing is put there without a window.
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}

say() { printf 'sphereboard: %s\n' "$*" >&2; }

stop() {
    say "$*"
    exit 1
}

# fetch WHAT COMMAND...: runs a command that needs the network; a failure says what could not be had.
fetch() {
    local what=$1
    shift
    "$@" || stop "could not install $what. The first run needs the network; run the same command again when it is there (command: $*)."
}

# apt_install PURPOSE PACKAGE...: installs the Debian packages that are missing, or prints the command that would.
apt_install() {
    local purpose=$1 missing=() package
    shift
    command -v dpkg-query >/dev/null || return 0 # not Debian: what is missing will say so itself
    for package in "$@"; do
        # shellcheck disable=SC2016 # dpkg-query expands this, not the shell
        [[ $(dpkg-query -W -f='${db:Status-Abbrev}' "$package" 2>/dev/null) == ii* ]] || missing+=("$package")
    done
    ((${#missing[@]})) || return 0

    local as_root=()
    if [[ $(id -u) != 0 ]]; then
        as_root=(sudo -n)
        sudo -n true 2>/dev/null ||
            stop "$purpose needs packages that I may not install here. Run: sudo apt-get update && sudo apt-get install -y --no-install-recommends ${missing[*]}"
    fi
    local install=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends "${missing[@]}") size
    fetch "the package lists" "${as_root[@]}" apt-get update -qq
    size=$(LC_ALL=C "${install[@]/-qq/-q}" --assume-no 2>/dev/null | sed -n 's/^After this operation, \(.*B\) of .*/\1/p') || true
    say "installing ${missing[*]} with apt-get, for $purpose (${size:-size unknown})"
    fetch "${missing[*]}" "${install[@]}" --yes >/dev/null
}

need_rust() {
    command -v cargo >/dev/null || stop "cargo is missing. Install Rust from https://rustup.rs, then run the same command again."
    command -v cc >/dev/null || apt_install "linking Rust programs" gcc libc6-dev
    command -v c++ >/dev/null || apt_install "the picture metric FLIP, which is C++" g++
    fetch "the Rust crates of Cargo.lock" cargo fetch --quiet --locked --target "$(rustc -vV | sed -n 's/^host: //p')"
}

# python_env FOLDER PYTHON LOCK WHAT: an environment that holds exactly the packages of the lock file. Quick when it already does.
python_env() {
    local env=$1 python=$2 lock=$3 what=$4
    cmp -s "$lock" "$env/installed.lock" && return 0
    local uv=target/uv/bin/uv
    if [[ $("$uv" --version 2>/dev/null) != "uv $UV_VERSION"* ]]; then
        python3 -c 'import ensurepip' 2>/dev/null || apt_install "Python environments" python3 python3-venv
        say "installing uv $UV_VERSION into target/uv (60 MB)"
        python3 -m venv --clear target/uv
        fetch "uv" target/uv/bin/python -m pip install --quiet --disable-pip-version-check "uv==$UV_VERSION"
    fi
    say "installing $what into $env"
    fetch "a Python $python" "$uv" venv --quiet --clear --python "$python" "$env"
    fetch "the packages of $lock" env VIRTUAL_ENV="$env" "$uv" pip sync --quiet --require-hashes "$lock"
    cp "$lock" "$env/installed.lock"
}
