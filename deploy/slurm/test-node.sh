#!/usr/bin/env bash
# A Slurm cluster of one node on this machine, for tests: munged, slurmctld and slurmd with all their files in one
# temporary folder, beside whatever else runs here. Needs root and the Debian packages slurm-wlm and munge.
#
#   deploy/slurm/test-node.sh start FOLDER   # then: export SLURM_CONF=FOLDER/slurm.conf
#   deploy/slurm/test-node.sh stop FOLDER
#
# No accounting, no cgroups, no authentication beyond a fresh munge key: for nothing but tests.
set -euo pipefail

usage() { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
fail() { echo "test-node.sh: $*" >&2; exit 1; }
[ $# -eq 2 ] || usage
folder=$2

# Waits until a command succeeds, for at most 30 s.
wait_until() {
  local what=$1
  shift
  for _ in $(seq 300); do
    if "$@" >/dev/null 2>&1; then return; fi
    sleep 0.1
  done
  tail -n 20 "$folder"/*.log >&2 || true
  fail "waited 30 s for $what; its logs are above"
}

# Ports that nobody uses, N of them.
free_ports() {
  python3 - "$1" <<'PYTHON'
import socket, sys
held = [socket.socket() for _ in range(int(sys.argv[1]))]
for s in held:
    s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in held))
PYTHON
}

configure() {
  local host memory
  host=$(hostname -s)
  memory=$(awk '/^MemTotal/ { print int($2 / 1024) }' /proc/meminfo)
  read -r controller node <<<"$(free_ports 2)"
  # Four CPUs are declared whatever there is, so that a coordinator and three workers run beside one another.
  # A job that is requeued may start again at once (it may not before a delay in a real cluster).
  cat >"$folder/slurm.conf" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$controller
SlurmdPort=$node
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0
DefMemPerCPU=100
JobRequeue=1
KillWait=10
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
SwitchType=switch/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=4 RealMemory=$memory State=UNKNOWN
PartitionName=test Nodes=$host Default=YES MaxTime=60 State=UP
CONF
}

start() {
  for program in munged slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null || fail "$program is not installed (Debian: slurm-wlm munge)"
  done
  [ "$(id -u)" = 0 ] || fail "it needs root"
  mkdir -p "$folder/state" "$folder/spool"
  # munged wants every folder above its files to be closed to other writers.
  chmod 0755 "$folder"
  dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 status=none
  chmod 0400 "$folder/munge.key"
  configure
  export SLURM_CONF=$folder/slurm.conf
  munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
    --log-file="$folder/munged.log" --seed-file="$folder/munged.seed"
  wait_until munged munge --socket="$folder/munge.socket" --no-input
  slurmctld -f "$SLURM_CONF"
  wait_until slurmctld scontrol ping
  slurmd -f "$SLURM_CONF"
  wait_until "an idle node" bash -c 'sinfo --noheader --format=%t | grep -qx idle'
}

# Ends the daemons by their process numbers; what is not there has ended.
stop() {
  export SLURM_CONF=$folder/slurm.conf
  if [ -e "$folder/slurmctld.pid" ]; then
    scancel --user="$(id -un)" >/dev/null 2>&1 || true
    for _ in $(seq 150); do
      [ -n "$(squeue --noheader 2>/dev/null)" ] || break
      sleep 0.1
    done
  fi
  for daemon in slurmd slurmctld munged; do
    [ -e "$folder/$daemon.pid" ] || continue
    process=$(cat "$folder/$daemon.pid")
    kill "$process" 2>/dev/null || continue
    for _ in $(seq 100); do
      kill -0 "$process" 2>/dev/null || break
      sleep 0.1
    done
    kill -KILL "$process" 2>/dev/null || true
  done
}

case $1 in
  start) start ;;
  stop) stop ;;
  *) usage ;;
esac
