#!/usr/bin/env bash
# Table 1 of Zhu et al. 2022: normals, depth and WHDR of maps, on unseen rooms and on real sets where they are given.
# minutes: 20
# usage: bash experiments/reproduce/table1.sh [KEY=VALUE...]
#   data.rooms=4                                fewer rooms
#   protocol.nyu=DIR protocol.nyu_list=FILE     NYUv2 and the numbers of its test pictures
#   protocol.iiw=DIR                            IIW; its test pictures count
#   study.rival=li2020                          the nets of Li et al. beside ours, or of any method, by its folder
# What is not given the table names as lacking.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/table1.toml "$@" -- --table 1_paper --plot normals
