#!/bin/sh
# Builds tyndall for the processor of this machine, with all of its instructions, into target/native/release. Such a
# program may not start on another machine, and its pixels may differ in the last bits from those of the portable build.
#
#     scripts/build-native.sh [options of cargo build]
set -eu
cd "$(dirname "$0")/.."
RUSTFLAGS="${RUSTFLAGS:-} -C target-cpu=native" cargo build --release --bin tyndall --target-dir target/native "$@"
echo "built $(pwd)/target/native/release/tyndall"
