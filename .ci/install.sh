#!/bin/sh
# Installs the programs deltille and deltag from an archive of a release:
#
#     sh install.sh FROM [VERSION]
#
# FROM is the address or the folder where the archives of a release lie; VERSION is that of this script unless another
# is named. The checksum is compared before anything is unpacked. The programs go to $DELTILLE_BIN, or to ~/.local/bin.
set -eu

from=${1:?give the address or the folder where the archives lie}
version=${2:-0.1.0}
bin=${DELTILLE_BIN:-${HOME:?is not set: name a folder in DELTILLE_BIN}/.local/bin}

fail() {
  echo "error: $*" >&2
  exit 2
}

case $(uname -s) in
  Linux) system=unknown-linux-musl ;;
  Darwin) system=apple-darwin ;;
  *) fail "no archive for $(uname -s): build the programs with cargo, or use install.ps1 on Windows" ;;
esac
case $(uname -m) in
  x86_64 | amd64) machine=x86_64 ;;
  aarch64 | arm64) machine=aarch64 ;;
  *) fail "no archive for $(uname -m): build the programs with cargo" ;;
esac
name=deltille-$version-$machine-$system

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM
for file in "$name.tar.gz" "$name.tar.gz.sha256"; do
  if [ -d "$from" ]; then
    cp "$from/$file" "$work/" || fail "$from has no $file"
  elif command -v curl >/dev/null; then
    curl -fsSL "$from/$file" -o "$work/$file" || fail "cannot get $from/$file"
  elif command -v wget >/dev/null; then
    wget -q "$from/$file" -O "$work/$file" || fail "cannot get $from/$file"
  else
    fail "neither curl nor wget is installed"
  fi
done

cd "$work"
if command -v sha256sum >/dev/null; then
  sha256sum -c "$name.tar.gz.sha256" >/dev/null 2>&1 || fail "$name.tar.gz is damaged: its checksum is another"
else
  shasum -a 256 -c "$name.tar.gz.sha256" >/dev/null 2>&1 || fail "$name.tar.gz is damaged: its checksum is another"
fi
tar -xzf "$name.tar.gz"
mkdir -p "$bin"
for program in deltille deltag; do
  # Beside its place and renamed, so that a program that runs is replaced whole.
  cp "$name/$program" "$bin/.$program.new"
  chmod 755 "$bin/.$program.new"
  mv "$bin/.$program.new" "$bin/$program"
done
echo "deltille $version is in $bin"
case :$PATH: in
  *:"$bin":*) ;;
  *) echo "$bin is not in PATH: export PATH=\"$bin:\$PATH\"" ;;
esac
