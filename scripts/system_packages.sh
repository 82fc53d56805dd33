#!/bin/sh
# Installs the libraries for off-screen rendering, and a browser for the tests of the page, where this may be done
# (Debian, root); says so where not.
set -u
packages="libegl1 libgl1-mesa-dri libosmesa6 chromium"

missing=""
for package in $packages; do
    dpkg -s "$package" >/dev/null 2>&1 || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
    echo "installing:$missing"
    { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $missing; } >/dev/null 2>&1 && exit 0
fi
echo "off-screen rendering and a browser need:$missing (Debian: apt-get install$missing); without them, pictures are left out and their tests skip"
exit 0
