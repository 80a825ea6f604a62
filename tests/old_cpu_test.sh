#!/usr/bin/env bash
# The check of the CPU, on one that lacks AVX: old_cpu_test.sh PROBE, a program compiled to need AVX2. Exit code 77: skipped.
set -u
if ! command -v qemu-x86_64 >/dev/null; then
  echo "skipped: qemu-x86_64 (package qemu-user) is not installed"
  exit 77
fi
message=$(qemu-x86_64 -cpu Nehalem "$1" 2>&1)
status=$?
echo "exit code $status: $message"
[ $status = 2 ] && [ "$(wc -l <<<"$message")" = 1 ] && grep -q 'needs a CPU with avx, which this one lacks' <<<"$message" &&
  qemu-x86_64 -cpu max "$1"
