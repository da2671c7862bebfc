#!/bin/sh
# Installs what is missing of packages.txt, without questions. Does nothing, quickly, where nothing is missing.
# KELLER_SETUP=skip in the environment leaves the system alone (other distributions, packages from elsewhere).
set -eu

fail() {
    echo "setup: $*" >&2
    exit 1
}

[ "${KELLER_SETUP:-}" != skip ] || exit 0
cd "$(dirname "$0")/.."
wanted=$(sed 's/#.*//' packages.txt | tr -s ' \t\n' ' ')

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    fail "this is not a Debian system: install the equivalents of$wanted; then run again with KELLER_SETUP=skip"
fi

# dpkg-query fails where a package is unknown to it; what it knows it prints all the same.
# shellcheck disable=SC2086 # a list of names
installed=$(dpkg-query --show --showformat '${db:Status-Status} ${Package}\n' $wanted 2>/dev/null |
    sed -n 's/^installed //p' | tr '\n' ' ') || true
missing=
for package in $wanted; do
    case " $installed" in
    *" $package "*) ;;
    *) missing="$missing $package" ;;
    esac
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo >/dev/null; then
    as_root=sudo
else
    fail "these packages are missing, and installing them needs root or sudo; as root run: apt-get install$missing"
fi

apt() {
    # shellcheck disable=SC2086 # empty for root
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=120 "$@"
}

echo "setup: installing$missing" >&2
apt update || fail "apt-get update failed (is there a network, and may this user use sudo?); missing:$missing"
# shellcheck disable=SC2086 # a list of names
apt install --yes --no-install-recommends $missing >&2 ||
    fail "apt-get install failed (its messages are above; is there a network?); missing:$missing"
