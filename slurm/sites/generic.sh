# A cluster whose software is simply there. Read by slurm/submit for building and planning, and at the start of every job.
# shellcheck shell=bash disable=SC2034,SC1091
#
# Copy it (slurm/submit --site my-site.sh) and change what your site has:
#   commands               run as they stand: module load ..., export PATH=...; one that fails (and is in no `if`, && or ||)
#                          stops the submission or the job
#   sbatch_options         options of every sbatch of a study; those after -- on the command line come later and win
#   RASTERBENCH_SCRATCH    a folder for unfinished measurements; empty: DIR/slurm/work. On a shared file system an
#                          interrupted family continues; on a local one only where the folder outlives the job
sbatch_options=()
RASTERBENCH_SCRATCH=
