#!/usr/bin/env bash
# Installs what `cargo build --features mpi` needs: Debian's Open MPI, and libclang, with which its headers are read.
set -euo pipefail
command -v mpicc >/dev/null && command -v mpirun >/dev/null && command -v clang >/dev/null && exit 0
apt-get update --quiet
apt-get install --quiet --yes --no-install-recommends libopenmpi-dev openmpi-bin clang libclang-dev
