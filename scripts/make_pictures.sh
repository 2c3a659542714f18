#!/usr/bin/env bash
# Makes the pictures of README.md anew, by the commands that stand beside them there. Needs a release build.
set -euo pipefail
cd "$(dirname "$0")/.."
PATH="$PWD/build/release:$PATH"
# In the README a picture's command is the first code span after it that writes into docs/, or the study that a plot is of.
grep -v '^    ' README.md | tr '\n' ' ' | grep -oE '`clerestory [^`]* -o (docs/[a-z_]+\.png|build/study)`' | tr -d '`' | while read -r command; do
  echo "$command"
  bash -c "$command"
done
cp build/study/error_time.svg docs/study.svg
