#!/bin/sh
# The figures and numbers of docs/choosing-inputs.md: `docs/figures/choosing-inputs.sh [DIR]`, with runout and runout-worker on
# the PATH. Writes numbers.csv, scales.csv and the pictures into DIR (a new temporary folder if none is named); a few
# minutes of two cores. Coarse on purpose: cells of 1 m.
set -eu

out=${1:-$(mktemp -d)}
mkdir -p "$out"
cd "$out"
[ -e quick/campaign.toml ] || runout init quick --example quick > init.txt

# The paper's slope at its mean strength (c 11.41 kPa, phi 21.14 degrees): factor of safety 0.845, a clear failure.
weak='fit.marginals.friction_angle_deg={family="weibull",mean=21.14,sd=5.47}'
soft='soil.softening={residual_cohesion_ratio=0.5,residual_friction_ratio=0.9,residual_dilation_ratio=0.0,displacement_m=0.2}'
wet='water.initial_pore_pressure="hydrostatic"'

number() { sed -n "s/^ *\"$1\": \"\{0,1\}\([^\",]*\).*/\1/p" "$2" | head -n 1; }

# One analysis with mean properties: NAME, then KEY=VALUE...
analyse() {
    name=$1
    shift
    set -- "$@" "$weak" slope.height_m=15.0 mesh.cell_size_m="${cell:-1.0}"
    arguments=$(for change in "$@"; do printf " --set '%s'" "$change"; done)
    eval "runout simulate quick/campaign.toml --deterministic --json ${picture:-} $arguments" > "$name.json" 2> "$name.log"
    if [ -n "${picture:-}" ]; then cp "slide-$name/displacement.png" "$name.png"; fi
    echo "$name,$(number displacement_q999_m "$name.json"),$(number reason "$name.json"),$(number simulated_s "$name.json")" >> numbers.csv
}
drawn() { picture="--no-animation --every 5 --out slide-$1"; analyse "$@"; picture=; }

echo "case,displacement_q999_m,reason,simulated_s" > numbers.csv
drawn reference
drawn water-table-at-ground "$wet" 'water.water_table="ground-surface"'
analyse water-table-at-mid-height "$wet" water.water_table=7.5
analyse water-sinks 'water.water_above_table="sinks"'
analyse ground-surface-closed 'water.ground_surface="closed"'
analyse one-phase 'analysis.formulation="one-phase"'
analyse bulk-modulus-100 water.bulk_modulus_mpa=100.0
analyse bulk-modulus-1600 water.bulk_modulus_mpa=1600.0
drawn softening "$soft"
cell=1.5 analyse cells-1.5
cell=0.5 analyse cells-0.5
cell=1.5 analyse cells-1.5-softening "$soft"
cell=0.5 analyse cells-0.5-softening "$soft"
analyse three-points-a-side mesh.points_per_cell_side=3
analyse pic-4 analysis.pic_rate_per_s=4.0
analyse pic-40 analysis.pic_rate_per_s=40.0
analyse local-damping-0.05 analysis.local_damping=0.05
analyse damping-rate-0.5 analysis.damping_rate_per_s=0.5
analyse frictional-base 'slope.base={friction=0.3}'
analyse dilation-5 soil.dilation_angle_deg=5.0
analyse dilation-5-softening soil.dilation_angle_deg=5.0 "$soft"

# Scales of fluctuation: a small campaign of softening soil in one phase each.
echo "horizontal_m,vertical_m,realisations,p_failure,mean_m,sd_m" > scales.csv
for scales in "2 2" "20 4" "40 40"; do
    horizontal=${scales% *}
    vertical=${scales#* }
    name=scales-$horizontal-$vertical
    sed -e "s/^scale_of_fluctuation_horizontal_m = .*/scale_of_fluctuation_horizontal_m = $horizontal.0/" \
        -e "s/^scale_of_fluctuation_vertical_m = .*/scale_of_fluctuation_vertical_m = $vertical.0/" \
        -e 's/^formulation = .*/formulation = "one-phase"/' \
        -e 's/^height_m = .*/height_m = 17.0/' -e 's/^cell_size_m = .*/cell_size_m = 1.0/' \
        -e 's/^duration_s = .*/duration_s = 15.0/' \
        -e 's/^maximum_realisations = .*/maximum_realisations = 60/' -e 's/^minimum_realisations = .*/minimum_realisations = 60/' \
        quick/campaign.toml > "quick/$name.toml"
    printf '\n[soil.softening]\nresidual_cohesion_ratio = 0.5\nresidual_friction_ratio = 0.9\nresidual_dilation_ratio = 0.0\ndisplacement_m = 0.2\n' >> "quick/$name.toml"
    # 3: the maximum is reached, as asked.
    runout run "quick/$name.toml" --out "run-$name" --no-page > "$name.log" 2>&1 || [ $? -eq 3 ]
    runout status "run-$name" --json > "$name.json"
    echo "$horizontal,$vertical,$(number realisations "$name.json"),$(number p_failure "$name.json"),$(number mean_m "$name.json"),$(number sd_m "$name.json")" >> scales.csv
done
echo "wrote $out/numbers.csv, $out/scales.csv and pictures"
