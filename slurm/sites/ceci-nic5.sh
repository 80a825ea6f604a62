# CECI, NIC5-like: nodes of two 32-core AMD EPYC, modules in yearly releases, the foss toolchain, partition batch.
# Written after the documentation of the CECI clusters; see README, "On a cluster".
# shellcheck shell=bash disable=SC2034,SC1091
command -v module >/dev/null || . /etc/profile.d/modules.sh # jobs do not start as login shells
module --quiet purge
module load releases/2023b foss/2023b # GCC 13.2, hwloc
# What the modules lack comes from conda-forge; README has the list. `conda create -p` this folder once, on the login node.
conda=${RASTERBENCH_CONDA:-$HOME/rasterbench-conda}
if [ -d "$conda" ]; then
  export PATH="$conda/bin:$PATH" CMAKE_PREFIX_PATH="$conda" PKG_CONFIG_PATH="$conda/lib/pkgconfig:$conda/share/pkgconfig"
  export LD_LIBRARY_PATH="$conda/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
fi
# batch is the default partition; the account is that of your project, if you have several: --account after --.
sbatch_options=(--partition=batch --time=04:00:00 --mem-per-cpu=2000)
RASTERBENCH_SCRATCH=${GLOBALSCRATCH:-} # shared by the nodes: an element that is requeued on its node goes on
