#!/usr/bin/env bash
# Runs an experiment as a Slurm array: each task renders a share of the runs, all into one folder of results, and a last
# job puts them together.
#
#     scripts/slurm-array.sh experiments/my.toml [TASKS, default 8] [more options of tyndall run]
#
# Times can only be compared between equal machines: for budgets in seconds ask for one kind (SBATCH_CONSTRAINT). A task that dies can
# be submitted again: it renders what is missing.
#SBATCH --job-name=tyndall
#SBATCH --cpus-per-task=16
#SBATCH --time=08:00:00
set -euo pipefail

tyndall=${TYNDALL:-target/release/tyndall}
if [[ -n ${SLURM_ARRAY_TASK_ID:-} ]]; then
    threads=${SLURM_CPUS_PER_TASK:-1}
    if [[ $TYNDALL_PART == merge ]]; then
        exec "$tyndall" merge "$@" --threads "$threads"
    fi
    exec "$tyndall" run "$@" --threads "$threads" --shard "$SLURM_ARRAY_TASK_ID/$TYNDALL_SHARDS"
fi

experiment=${1:?an experiment file is needed}
tasks=${2:-8}
shift $(($# > 1 ? 2 : 1))
export TYNDALL_SHARDS=$tasks
array=$(TYNDALL_PART=run sbatch --parsable --array="1-$tasks" "$0" "$experiment" "$@")
# What did not finish leaves partial results, which say so.
TYNDALL_PART=merge sbatch --dependency="afterany:$array" --array=1-1 "$0" "$experiment" "$@"
