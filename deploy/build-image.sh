#!/usr/bin/env bash
# Builds static binaries and, from them alone, the image runout:local. Needs Rust, a C compiler and Docker.
set -euo pipefail
cd "$(dirname "$0")/.."
target=x86_64-unknown-linux-gnu
folder=${CARGO_TARGET_DIR:-target}/static
RUSTFLAGS='-C target-feature=+crt-static' \
  cargo build --release --locked --target "$target" --target-dir "$folder" -p runout -p runout-worker
context=$(mktemp -d)
trap 'rm -rf "$context"' EXIT
mkdir "$context/runs"
cp deploy/Dockerfile "$folder/$target/release/runout" "$folder/$target/release/runout-worker" "$context"
docker build --tag runout:local "$context"
