#!/usr/bin/env bash
# Starts a Slurm of four nodes on this machine: `slurm.sh FOLDER`, for `cargo xtask slurm`. Prints `ready` when all nodes are idle. When its
# stdin closes it ends the processes that it started, by id. The folder has its state: slurm.conf, and the process number of each node in node-NAME.
set -euo pipefail

slurm_started=()

# In the folder $1, on separate ports.
slurm_up() {
  local folder="$1" host base node
  host=$(hostname -s)
  base=$((20000 + $$ % 20000))
  mkdir -p "$folder/state"
  cat >"$folder/slurm.conf" <<CONF
ClusterName=posegate
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$base
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool-%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd-%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
SlurmdTimeout=10
KillWait=2
MpiDefault=none
NodeName=n[0-3] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((base + 1))-$((base + 4))] CPUs=1
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
  export SLURM_CONF="$folder/slurm.conf"
  head -c 1024 /dev/urandom >"$folder/munge.key"
  chmod 400 "$folder/munge.key"
  munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
    --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" --seed-file="$folder/munged.seed" >"$folder/munged.out" 2>&1 &
  slurm_started+=($!)
  slurm_wait "munged" test -S "$folder/munge.socket"
  slurmctld -D -i >"$folder/slurmctld.out" 2>&1 &
  slurm_started+=($!)
  for node in n0 n1 n2 n3; do
    mkdir -p "$folder/spool-$node"
    slurm_node "$folder" $node
  done
  slurm_wait "four idle nodes" slurm_idle 4
}

# Starts a node.
slurm_node() {
  slurmd -D -N "$2" >"$1/slurmd-$2.out" 2>&1 &
  slurm_started+=($!)
  echo $! >"$1/node-$2"
}

slurm_idle() { [ "$(sinfo -h -N -t idle -o %n 2>/dev/null | wc -l)" -eq "$1" ]; }

slurm_down() {
  local id
  for id in "${slurm_started[@]}"; do
    kill "$id" 2>/dev/null || true
  done
  for id in "${slurm_started[@]}"; do
    wait "$id" 2>/dev/null || true
  done
  slurm_started=()
}

# Waits for a command to succeed, five minutes at most: what for, and the command.
slurm_wait() {
  local what="$1" end=$((SECONDS + 300))
  shift
  until "$@"; do
    if [ $SECONDS -ge $end ]; then
      echo "slurm: waited in vain for $what" >&2
      squeue >&2 || true
      sinfo -N -l >&2 || true
      return 1
    fi
    sleep 0.2
  done
}

trap slurm_down EXIT
slurm_up "$1"
echo ready
cat >/dev/null
