#!/usr/bin/env bash
# A data set on a Slurm cluster: an array of workers, then the last step.
#
#   mkdir -p logs
#   job=$(sbatch --parsable --array=0-63 scripts/cluster/slurm.sh random-shapes /scratch/shapes 10000000)
#   sbatch --dependency=afterok:$job --wrap "spts dataset finish /scratch/shapes"
#
# Every task finds its share of the files in SLURM_ARRAY_TASK_ID, _MIN and _COUNT. A task that was ended is begun again
# with the same line (--requeue does so by itself): what is there is not made twice.
#SBATCH --job-name=spts-dataset
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=500M
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --output=logs/%A_%a.log
set -euo pipefail
spec=$1 out=$2 rows=${3:-}
exec "${SPTS:-spts}" dataset make "$spec" --out "$out" ${rows:+--rows "$rows"} --threads "${SLURM_CPUS_PER_TASK:-4}" --json
