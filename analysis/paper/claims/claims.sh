#!/usr/bin/env bash
# Makes the table of claims from a finished study: claims.sh STUDY WORK, STUDY being the folder that `sdt paper follow`
# wrote and WORK a folder for what lies between. Run it from here; twenty minutes on two cores.
set -euo pipefail
study=$(realpath "$1") work=$2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$work/labels" "$work/small_room" "$work/predictions"

# Held-out worlds of the study, and small rooms: the worlds are so large that hardly a scan of theirs lies in a domain.
cp "$study"/recordings/unseen_worlds/*/labels/*.csv "$work/labels/"
for seed in $(seq 1000 1159); do
    # Of some seeds the operator's path meets the box, and `sdt` refuses them: those are left out.
    sdt record scene --scenario "$here/small_room.toml" --seed "$seed" --no-camera --perturb --seconds 12 \
        --out "$work/small_room/small_room_$seed.mcap" || true
done
sdt label auto "$work"/small_room/*.mcap --from truth --labels "$work/labels"

models=()
for level in 0 1 2 3; do
    for seed in 0 1 2 3 4; do
        name=paper-plain-level$level-seed$seed
        models+=(--model "$study/models/$name/$name")
        sdt replay "$study/models/$name/$name" "$study"/recordings/unseen_worlds/*/recordings/*.mcap \
            "$work"/small_room/*.mcap --labels "$work/labels" --every labelled --out "$work/predictions/$name.parquet"
    done
done

sdt errors claims "$work"/predictions/*.parquet "${models[@]}" --evaluation "$here/../follow/runs.parquet" \
    --recordings "$study/recordings/unseen_worlds" --recordings "$work/small_room" --out "$work/claims"
