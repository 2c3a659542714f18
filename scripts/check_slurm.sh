#!/usr/bin/env bash
# A batch under a real Slurm: starts a controller and a node daemon of its own on this machine, runs docs/batch.sbatch as an array of
# four tasks, kills one in the middle and requeues it, and compares what they wrote with what one run writes.
#   scripts/check_slurm.sh [--where-possible] [FOLDER OF THE BUILD]
# Wrong or missing files always fail. Where Slurm itself cannot be installed or started, or does not run the tasks, nothing was learned
# about batches: that fails too, but with --where-possible it is said and passed over.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
where_possible=no
if [ "${1:-}" = --where-possible ]; then where_possible=yes && shift; fi
program=$(realpath "${1:-$builds/release}")/clerestory
[ -x "$program" ] || { echo "$program: not built" >&2; exit 2; }

work=$(mktemp -d)
daemons=()
job=
finish() {
    local status=$?
    trap '' INT TERM HUP
    if [ -n "$job" ]; then timeout 5 scancel "$job" 2>/dev/null || true; fi
    [ ${#daemons[@]} -eq 0 ] || kill "${daemons[@]}" 2>/dev/null || true
    for _ in $(seq 20); do
        [ -n "$(jobs -pr)" ] || break
        sleep 0.25
    done
    [ ${#daemons[@]} -eq 0 ] || kill -9 "${daemons[@]}" 2>/dev/null || true
    # What the daemons have left: tasks and their keepers, known by the configuration that they were started with.
    local configuration=${SLURM_CONF:-} process
    unset SLURM_CONF
    if [ -n "$configuration" ]; then
        for process in $(grep -lzsx "SLURM_CONF=$configuration" /proc/[0-9]*/environ | cut -d/ -f3); do kill -9 "$process" 2>/dev/null || true; done
    fi
    wait 2>/dev/null || true
    rm -rf "$work"
    exit "$status"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP
show_logs() { tail -n 20 "$work"/*.log >&2 2>/dev/null || true; }
wrong() {
    show_logs
    echo "check_slurm: $*" >&2
    exit 1
}
cannot() { # what Slurm did not do
    [ "$where_possible" = yes ] || { show_logs && echo "check_slurm: $*" >&2 && exit 1; }
    echo "check_slurm: LEFT OUT, not passed: $*"
    exit 0
}
# within SECONDS COMMAND...: asks until it holds; false where it has not held by then.
within() {
    local end=$((SECONDS + $1))
    shift
    until "$@"; do
        [ "$SECONDS" -lt "$end" ] || return 1
        sleep 0.1
    done
}

if ! command -v slurmctld >/dev/null || ! command -v slurmd >/dev/null; then
    (install_packages slurm-wlm) || cannot "the package slurm-wlm cannot be installed here"
fi

# Any free ports, no authentication service, no control groups: nothing but the array's own machinery is under test.
port=$((20000 + $$ % 20000))
node=$(uname -n | cut -d. -f1)
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
MinJobAge=3600
JobRequeue=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
END
export SLURM_CONF=$work/slurm.conf
start_daemon() { # NAME: it ends with this script, however that ends
    setpriv --pdeathsig KILL "$1" -D -f "$SLURM_CONF" >"$work/$1-start.log" 2>&1 </dev/null &
    daemons+=($!)
}
node_idle() { timeout 5 sinfo -h -o %T 2>/dev/null | grep -qx idle; }
start_daemon slurmctld
start_daemon slurmd
within 20 node_idle || cannot "Slurm's daemons did not come up within 20 s here: $(grep -hsiE 'fatal|error' "$work"/*.log | head -n 2 | tr '\n' ' ')"
echo "Slurm $(sinfo --version | cut -d' ' -f2) is up"

cat >"$work/jobs.toml" <<END
[[job]]
map = "$PWD/data/*.exr"
size = 255
samples = 4096
rotate_y = {from = 0, to = 351, step = 9}
output = ["{map}_{rotation:03}.exr", "{map}_{rotation:03}.png"]
END
"$program" batch "$work/jobs.toml" -o "$work/whole" -q || wrong "one run by itself fails"

victim=3 # the task that is killed
"$program" batch "$work/jobs.toml" -o "$work/parts" --shard "$victim/4" --dry-run --json - | grep -oE "$work/parts/[^\"]+" | sort >"$work/victims"
# What the victim has written of its outputs; of its jobs, those that are done with both.
written() { while read -r file; do [ ! -e "$file" ] || echo "$file"; done <"$work/victims"; }
jobs_written() { written | sed 's/\....$//' | uniq -d | wc -l; }
in_state() { timeout 5 squeue -h -r -j "$job" -t "$1" -o %K 2>/dev/null; }
some_written() { [ "$(jobs_written)" -ge 3 ]; }
still_running() { in_state RUNNING,COMPLETING | grep -qx "$victim"; }
victim_ended() { ! still_running; }
put_back() { timeout 5 scontrol requeue "${job}_$victim" 2>/dev/null; }
ended() {
    local left
    left=$(timeout 5 squeue -h -j "$job" -o %K 2>/dev/null) && [ -z "$left" ]
}
begun() { some_written || ended; }
# Tasks that Slurm never ran say nothing about batches; those that it ran do.
no_end() {
    [ -z "$(in_state RUNNING)" ] || wrong "tasks still run after $1 s: $(in_state RUNNING | tr '\n' ' ')"
    cannot "Slurm did not run all tasks within $1 s"
}

job=$(CLERESTORY=$program sbatch --parsable --array=1-4 --cpus-per-task=1 --mem=0 --chdir="$work" docs/batch.sbatch "$work/jobs.toml" "$work/parts") ||
    cannot "Slurm takes no jobs here"
within 120 begun || no_end 120
# By kill -9 from outside, as the kernel does when memory runs out: a signal through Slurm and a requeue would kill it twice.
killed=no
if in_state RUNNING | grep -qx "$victim"; then
    for process in $(pgrep -f "batch $work/jobs.toml -o $work/parts"); do
        if tr '\0' '\n' 2>/dev/null <"/proc/$process/environ" | grep -qx "SLURM_ARRAY_TASK_ID=$victim"; then
            if kill -9 "$process" 2>/dev/null; then killed=yes; fi
        fi
    done
fi
if [ "$killed" = yes ]; then
    within 30 victim_ended || cannot "Slurm did not notice within 30 s that a task was killed"
    within 20 put_back || cannot "Slurm did not take the killed task back"
    before=$(jobs_written)
    echo "task $victim was killed after $before of its $(($(wc -l <"$work/victims") / 2)) jobs and requeued"
    # Slurm lets a requeued task wait two minutes, so that the node has forgotten its first life's credential; seconds do here.
    scontrol update jobid="${job}_$victim" starttime=now+5 || cannot "Slurm does not let the requeued task start soon"
fi
within 300 ended || no_end 300
for task in 1 2 3 4; do
    [ -e "$work/clerestory-${job}_$task.log" ] || cannot "Slurm never started task $task"
done

"$program" merge "$work"/parts/batch-*-of-4.json --json "$work/merged.json" || wrong "the batch is not complete"
for side in whole parts; do
    (cd "$work/$side" && find . -name '*.exr' -o -name '*.png' -o -name '.clerestory-*' | sort | xargs sha256sum) >"$work/$side.sums"
done
cmp "$work/whole.sums" "$work/parts.sums" || wrong "four tasks wrote something else than one run"
files=$(wc -l <"$work/parts.sums")
[ "$killed" = yes ] || cannot "four tasks wrote the $files files of one run, but had ended before one could be killed"
skipped=$(grep -c '"status": "skipped"' "$work/parts/batch-$victim-of-4.json" || true)
[ "$skipped" -eq "$before" ] || wrong "the requeued task skipped $skipped jobs, not the $before that were done"
echo "four tasks, one of them killed and requeued: $files files, each that of one run; the $skipped jobs that were done were not done twice"
