#!/usr/bin/env bash
# Runs the homogeneous slopes of the paper's two examples under each reading of it; writes readings.csv and the table
# in README.md. Cells of 0.8 and 0.4 m take some eight minutes of one core, the readings at 0.2 m about as long again.
#
#   campaigns/readings/readings.sh [--cells "0.8 0.4 0.2"] [RUNOUT]     RUNOUT: the program, `runout` by default
set -euo pipefail
cells="0.8 0.4"
[ "${1:-}" = "--cells" ] && { cells=$2; shift 2; }
runout=$(realpath "$(command -v "${1:-runout}")")
cd "$(dirname "$0")"

# number KEY: its value in the JSON document on standard input, without quotes.
value() { tr -d '\n' | sed -E "s/.*\"$1\": *\"?([^,\"}]*)\"?.*/\1/; s/ +$//"; }
# metres NUMBER: two decimals, or as it is if it is none.
metres() { case $1 in null) echo - ;; *) LC_ALL=C printf '%.2f' "$1" ;; esac; }

# read_as EXAMPLE PHI PAPER READING CELL [--set ...]: one line of the table.
read_as() {
    local example=$1 phi=$2 paper=$3 reading=$4 cell=$5
    shift 5
    # At 0.2 m only what a few minutes can afford.
    case "$cell $reading" in 0.2*phreatic* | 0.2*submerged* | 0.2*closed* | 0.2*sinks*) return ;; esac
    echo "example $example, phi $phi, $reading, $cell m" >&2
    local found
    found=$("$runout" simulate "example-$example.toml" --deterministic --json \
        --set "fit.marginals.friction_angle_deg.mean=$phi" --set "mesh.cell_size_m=$cell" "$@")
    local field
    field() { value "$1" <<<"$found"; }
    echo "$example,$phi,$reading,$cell,$(metres "$(field max_displacement_m)"),$(metres "$(field displacement_q999_m)"),$(
        metres "$(field toe_advance_m)"),$(metres "$(field time_to_rest_s)"),$(field reason),$paper"
}

# readings EXAMPLE PHI PAPER: all of one example.
readings() {
    local cell
    for cell in $cells; do
        read_as "$@" "one phase; each point its own strain; local damping 0.01" "$cell" \
            --set 'analysis.volumetric_strain="point"' --set analysis.pic_rate_per_s=0.0 --set analysis.local_damping=0.01
        read_as "$@" "one phase" "$cell"
    done
    local two=(--set 'analysis.formulation="two-phase"' --set analysis.pic_rate_per_s=13.0)
    local phreatic=(--set 'water.initial_pore_pressure="hydrostatic"' --set 'water.water_table="ground-surface"')
    local submerged=(--set 'water.initial_pore_pressure="submerged"' --set water.free_water_level_m=15.0)
    for cell in $cells; do
        read_as "$@" "two phases; no pore pressure at first but the water sinks; drained" "$cell" "${two[@]}" \
            --set 'water.water_above_table="sinks"'
    done
    local surface
    for surface in drained closed; do
        for cell in $cells; do
            local at=(--set "water.ground_surface=\"$surface\"")
            read_as "$@" "two phases; no pore pressure; $surface" "$cell" "${two[@]}" "${at[@]}"
            read_as "$@" "two phases; phreatic surface at the ground; $surface" "$cell" "${two[@]}" "${at[@]}" "${phreatic[@]}"
            read_as "$@" "two phases; submerged; $surface" "$cell" "${two[@]}" "${at[@]}" "${submerged[@]}"
        done
    done
}

{
    echo "example,friction_angle_deg,reading,cell_size_m,max_displacement_m,displacement_q999_m,toe_advance_m,time_to_rest_s,ended,paper_m"
    readings 1 21.14 5.52
    readings 1 27.14 5.52
    readings 2 26.64 1.24
} >readings.csv

# The table in README.md, between its two marks.
awk -F, 'NR == 1 {
    print "| example | phi, deg | reading | cells, m | largest displacement, m | 99.9 % quantile, m | toe advance, m | at rest after, s | paper, m |"
    print "|---|---|---|---|---|---|---|---|---|"; next }
{ rest = $9 == "at-rest" ? $8 : $9
  print "| " ($1 == 1 ? "I" : "II") " | " $2 " | " $3 " | " $4 " | " $5 " | " $6 " | " $7 " | " rest " | " $10 " |" }' \
    readings.csv >table.md
awk '/<!-- table -->/ { print; while ((getline line < "table.md") > 0) print line; skip = 1; next }
/<!-- end of table -->/ { skip = 0 } !skip' README.md >README.new
mv README.new README.md
rm table.md
