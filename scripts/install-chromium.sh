#!/usr/bin/env bash
# Installs Debian's Chromium, in which tests/page.rs tries the page of an experiment; without it that test is skipped.
set -euo pipefail
command -v chromium >/dev/null && exit 0
apt-get update --quiet
apt-get install --quiet --yes --no-install-recommends chromium
