#!/usr/bin/env bash
# Builds static binaries and, from them alone, the image runout:local. Needs Rust, a C compiler and Docker. An image
# that was built from the same sources is left as it is.
set -euo pipefail
cd "$(dirname "$0")/.."
target=x86_64-unknown-linux-gnu
folder=${CARGO_TARGET_DIR:-target}/static

# Of everything that the binaries and the image are made from, names and contents.
sources=$(find Cargo.toml Cargo.lock campaigns core proto coordinator worker deploy/Dockerfile deploy/build-image.sh -type f -print0 |
  LC_ALL=C sort -z | xargs -0 sha256sum | sha256sum | cut -d ' ' -f 1)
label=runout.sources
built=$(docker image inspect --format "{{ index .Config.Labels \"$label\" }}" runout:local 2>/dev/null || true)
if [ "$built" = "$sources" ]; then
  echo "runout:local is of these sources"
  exit
fi

RUSTFLAGS='-C target-feature=+crt-static' \
  cargo build --release --locked --target "$target" --target-dir "$folder" -p runout -p runout-worker
context=$(mktemp -d)
trap 'rm -rf "$context"' EXIT
mkdir "$context/empty"
cp deploy/Dockerfile "$folder/$target/release/runout" "$folder/$target/release/runout-worker" "$context"
strip --strip-debug "$context/runout" "$context/runout-worker"
docker build --label "$label=$sources" --tag runout:local "$context"
