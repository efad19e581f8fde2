#!/usr/bin/env bash
#SBATCH --job-name={{NAME}}-coordinator
#SBATCH --output="{{LOGS}}/coordinator-%j.log"
#SBATCH --open-mode=append
#SBATCH --time={{TIME}}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --signal=B:USR1@{{LEAD_S}}
# The coordinator of a Runout campaign. Written by `runout submit slurm`, which writes it anew when it is run again.
# Before the time limit it stops in good order and has itself requeued; the next run goes on where this one stopped.
set -u
runout={{RUNOUT}}
run_directory={{RUN_DIRECTORY}}
most_crashes=5

{{JOB}}

if [ ! -x "$runout" ]; then
  say "$runout is not there on $(hostname): it must be on a file system that the nodes share"
  exit 2
fi

# Where the workers' nodes find this one; RUNOUT_HOST names another of its addresses (a faster network, say).
host=${RUNOUT_HOST:-$(hostname)}
address=$(getent ahostsv4 "$host" | awk 'NR == 1 { print $1 }')
if [ -z "$address" ]; then
  say "no address is known for $host: set RUNOUT_HOST to a name or address of this node that the others can reach"
  exit 2
fi
case $address in
  127.*) say "$host is $address: only workers on this node will find it; RUNOUT_HOST names another address" ;;
esac

requeue=false
pass_on() { interrupted=true; [ -z "$child" ] || kill -TERM "$child" 2>/dev/null; }
trap 'requeue=true; pass_on' USR1
trap 'stopping=true; pass_on' TERM INT

# Workers of this campaign that are in the queue, or in the given state only.
cancel_workers() {
  local job
  job=$(cat "$run_directory/slurm/workers.job" 2>/dev/null) || return
  scancel --quiet "$@" "$job"
}

crashes=0
while :; do
{{LISTEN}}
  child=$!
  wait_for_child
  # Signals from 128; 130 is its own code for an interruption.
  { [ "$code" -gt 128 ] && [ "$code" -ne 130 ] && ! $stopping && ! $requeue; } || break
  crashes=$((crashes + 1))
  [ "$crashes" -lt "$most_crashes" ] || break
  say "the coordinator ended with exit code $code and is started again"
done

case $code in
  0 | 3)
    say "the campaign is over (exit code $code)"
    cancel_workers --state=PENDING
    ;;
  *)
    if $requeue && ! $stopping; then
      say "the time limit is near: requeued"
      scontrol requeue "$SLURM_JOB_ID" && exit 0
      say "it could not be requeued; run the same \`runout submit slurm\` again to go on"
    elif ! $stopping; then
      # Nobody will come back for the workers.
      say "the coordinator ended with exit code $code; its workers are cancelled"
      cancel_workers
    fi
    ;;
esac
exit "$code"
