#!/usr/bin/env bash
#SBATCH --job-name={{NAME}}-worker
#SBATCH --output="{{LOGS}}/worker-%A_%a.log"
#SBATCH --open-mode=append
#SBATCH --array=1-{{WORKERS}}
#SBATCH --time={{TIME}}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={{SLOTS}}
#SBATCH --requeue
# A worker of a Runout campaign. Written by `runout submit slurm`, which writes it anew when it is run again. More
# workers: `sbatch --array=1-10 THIS_FILE`. It leaves before its time limit and has itself requeued while the campaign
# is not over. Cancelling it does no harm: what it was computing is handed to another one.
set -u
runout={{RUNOUT}}
worker={{WORKER}}
run_directory={{RUN_DIRECTORY}}
most_crashes=5

{{JOB}}

if [ ! -x "$worker" ]; then
  say "$worker is not there on $(hostname): it must be on a file system that the nodes share"
  exit 2
fi

# From the run directory's files, where no coordinator answers.
campaign_is_over() {
  local state
  state=$("$runout" status "$run_directory" --json | sed -n 's/^  "state": "\(.*\)",$/\1/p')
  case $state in converged | maximum | failed) return 0 ;; *) return 1 ;; esac
}

task="${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
# Newer versions of Slurm say when this job ends; for others it is what was asked for when it was submitted.
end=${SLURM_JOB_END_TIME:-$(($(date +%s) + {{LIMIT_S}}))}
started=$(date +%s)
given=$((end - {{RESERVE_S}} - started))
left() { echo $((end - {{RESERVE_S}} - $(date +%s))); }

trap 'stopping=true; interrupted=true; [ -z "$child" ] || kill -TERM "$child" 2>/dev/null' TERM INT USR1

crashes=0
code=0
while ! campaign_is_over; do
  $stopping && exit 0
{{WORK}}
  child=$!
  wait_for_child
  if $stopping || [ "$code" -eq 2 ]; then
    # Asked to leave, or unable to work for this campaign; the lines above say why.
    exit "$code"
  fi
  campaign_is_over && break
  if [ "$code" -ne 0 ] && [ "$(left)" -gt $((given / 2)) ]; then
    crashes=$((crashes + 1))
    [ "$crashes" -lt "$most_crashes" ] || { say "it crashed $crashes times and is given up"; exit "$code"; }
    say "the worker ended with exit code $code and is started again"
    continue
  fi
  # A worker that leaves in order has used a third of its time at least, or it was set aside for wrong results: the
  # longest realisation and the reserve that it keeps for another one are five halves of that realisation.
  if [ "$code" -eq 0 ] && [ "$(left)" -gt $((given * 2 / 3)) ]; then
    say "the worker left although there was time; the lines above say why"
    exit 1
  fi
  say "the time limit is near: requeued"
  scontrol requeue "$task" && exit 0
  say "it could not be requeued; run the same \`runout submit slurm\` again to go on"
  exit 1
done
say "the campaign is over"
