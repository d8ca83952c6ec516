#!/bin/sh
# Puts Debian's Python for aarch64 into a folder: fetch_python.sh FOLDER. apt works in a folder of its own, so
# that the machine's packages stay as they are and root is not needed. It takes half a minute and 70 MB.
set -eu
folder=$1
part=$folder.part
rm -rf "$part"
mkdir -p "$part/state/lists/partial" "$part/cache/archives/partial" "$part/root"
cd "$part"
part=$PWD
: > status
options="-qq -o Dir::State=$part/state -o Dir::State::status=$part/status -o Dir::Cache=$part/cache
-o APT::Architecture=arm64 -o APT::Architectures=arm64 -o APT::Sandbox::User="
# shellcheck disable=SC2086  # a list of words
apt-get $options update
version=$(apt-cache $options show python3-minimal | sed -n 's/^Version: \(3\.[0-9]*\).*/\1/p' | head -n 1)
apt-get $options download libc6 zlib1g libexpat1 python3-minimal \
    "python$version-minimal" "libpython$version-minimal" "libpython$version-stdlib"
for package in *.deb; do dpkg-deb -x "$package" root; done
cd - > /dev/null
rm -rf "$folder"
mv "$part/root" "$folder"
rm -rf "$part"
