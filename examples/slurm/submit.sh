#!/bin/sh
# An array of SHARDS tasks and a merge that waits for all of them: `./submit.sh SITE DIR SHARDS`. Prints the numbers of both.
set -eu
site=$(realpath "$1") output=$(realpath -m "$2") last=$(($3 - 1))
here=$(dirname "$(realpath "$0")")
# With several clusters, the cluster's name follows the number.
array=$(sbatch --parsable --array="0-$last" "$here/build.sbatch" "$site" "$output")
array=${array%%;*}
# A merge whose array finally fails would wait forever.
merge=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes "$here/merge.sbatch" "$output" "$site")
echo "$array ${merge%%;*}"
