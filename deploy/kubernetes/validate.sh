#!/usr/bin/env bash
# Checks the manifests here against the schemas of Kubernetes, offline once the Python package kubernetes-validate, which
# carries them, is there. Needs Python 3; installs the package into a temporary folder unless it is installed.
set -euo pipefail
cd "$(dirname "$0")"
# The oldest and the newest version that these are meant for.
versions=(1.29 1.37)
validate=kubernetes-validate
if ! command -v "$validate" >/dev/null; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  if ! { python3 -m venv "$folder" && timeout 300 "$folder/bin/pip" install --quiet "kubernetes-validate==1.37.0"; }; then
    echo "MANIFESTS NOT VALIDATED: the Python package kubernetes-validate cannot be installed" >&2
    exit 3
  fi
  validate=$folder/bin/kubernetes-validate
fi
for version in "${versions[@]}"; do
  "$validate" --strict --kubernetes-version "$version" ./*.yaml
done
