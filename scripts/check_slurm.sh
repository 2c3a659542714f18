#!/usr/bin/env bash
# A batch under a real Slurm: starts a controller and a node daemon of its own on this machine, runs docs/batch.sbatch as an array of
# four tasks, kills one in the middle and requeues it, and compares what they wrote with what one run writes.
#   scripts/check_slurm.sh [FOLDER OF THE BUILD]
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages slurm-wlm
program=$PWD/${1:-build/release}/clerestory
[ -x "$program" ] || { echo "$program: not built" >&2; exit 2; }

work=$(mktemp -d)
daemons=()
finish() {
    [ ${#daemons[@]} -eq 0 ] || kill "${daemons[@]}" 2>/dev/null || true
    wait 2>/dev/null || true
    rm -rf "$work"
}
trap finish EXIT
fail() {
    echo "$*" >&2
    tail -n 20 "$work"/*.log >&2 || true
    exit 1
}

# Any free ports, no authentication service, no control groups: nothing but the array's own machinery is under test.
port=$((20000 + $$ % 20000))
node=$(hostname -s)
mkdir -p "$work/state" "$work/spool"
cat >"$work/slurm.conf" <<END
ClusterName=check
SlurmctldHost=$node(127.0.0.1)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
AuthType=auth/none
CredType=cred/none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
SchedulerParameters=sched_interval=1,bf_interval=1
KillWait=5
JobRequeue=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
END
export SLURM_CONF=$work/slurm.conf
slurmctld -D -f "$SLURM_CONF" >"$work/controller.log" 2>&1 &
daemons+=($!)
slurmd -D -f "$SLURM_CONF" >"$work/node.log" 2>&1 &
daemons+=($!)
for _ in $(seq 60); do
    sinfo -h -o %T 2>/dev/null | grep -qx idle && break
    sleep 0.5
done
sinfo -h -o %T 2>/dev/null | grep -qx idle || fail "Slurm did not come up"
echo "Slurm $(sinfo --version | cut -d' ' -f2) is up"

cat >"$work/jobs.toml" <<END
[[job]]
map = "$PWD/data/*.exr"
size = 255
samples = 4096
rotate_y = {from = 0, to = 351, step = 9}
output = ["{map}_{rotation:03}.exr", "{map}_{rotation:03}.png"]
END
"$program" batch "$work/jobs.toml" -o "$work/whole" -q

files_of() { find "$1" -name '*.exr' -o -name '*.png' | wc -l; }
jobs_in_state() { squeue -h -r -j "$job" -t "$1" -o %i 2>/dev/null | wc -l; }
job=$(CLERESTORY=$program sbatch --parsable --array=1-4 --cpus-per-task=1 --mem=0 --chdir="$work" docs/batch.sbatch "$work/jobs.toml" "$work/parts")
# One task is killed as soon as it has written something, and put into the queue again.
for _ in $(seq 600); do
    [ "$(jobs_in_state RUNNING)" -gt 0 ] && [ -d "$work/parts" ] && [ "$(files_of "$work/parts")" -ge 16 ] && break
    sleep 0.1
done
victim=$(squeue -h -r -j "$job" -t RUNNING -o %K | head -n 1)
[ -n "$victim" ] || fail "no task was running when one was to be killed"
before=$(files_of "$work/parts")
# By kill -9 from outside, as the kernel does when memory runs out: a signal through Slurm and a requeue would kill it twice.
for process in $(pgrep -f "batch $work/jobs.toml -o $work/parts"); do
    if tr '\0' '\n' <"/proc/$process/environ" | grep -qx "SLURM_ARRAY_TASK_ID=$victim"; then kill -9 "$process"; fi
done
for _ in $(seq 120); do
    squeue -h -r -j "$job" -t RUNNING,COMPLETING -o %K | grep -qx "$victim" || break
    sleep 0.25
done
for _ in $(seq 20); do
    if scontrol requeue "${job}_$victim" 2>/dev/null; then requeued=yes && break; fi
    sleep 0.5
done
[ "${requeued:-}" = yes ] || fail "Slurm did not take task $victim back"
echo "task $victim was killed after $before files and requeued"
# Slurm lets a requeued task wait two minutes, so that the node has forgotten its first life's credential; seconds do here.
scontrol update jobid="${job}_$victim" starttime=now+5
for _ in $(seq 1200); do
    [ -z "$(squeue -h -j "$job" 2>/dev/null)" ] && break
    sleep 0.5
done
[ -z "$(squeue -h -j "$job" 2>/dev/null)" ] || fail "the tasks did not end"

"$program" merge "$work"/parts/batch-*-of-4.json --json "$work/merged.json" || fail "the batch is not complete"
for side in whole parts; do
    (cd "$work/$side" && find . -name '*.exr' -o -name '*.png' -o -name '.clerestory-*' | sort | xargs sha256sum) >"$work/$side.sums"
done
cmp "$work/whole.sums" "$work/parts.sums" || fail "four tasks wrote something else than one run"
[ "$(grep -c '"status": "skipped"' "$work/merged.json")" -gt 0 ] || fail "the requeued task skipped nothing"
echo "four tasks, one of them killed and requeued: $(wc -l <"$work/parts.sums") files, each that of one run; $(
    grep -c '"status": "skipped"' "$work/merged.json") jobs were not done twice"
