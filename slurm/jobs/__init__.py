"""Studies as SLURM job arrays: what slurm/submit, slurm/merge and slurm/status share. Python 3.9, standard library only."""
