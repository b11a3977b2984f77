#!/usr/bin/env bash
# Figure 1 of Zhu et al. 2022, of real photographs of rooms: taken apart, objects put in, a material replaced by a mirror.
# These are the pictures of the README. The paper's own photographs do not come with this project.
# usage: bash experiments/reproduce/fig1.sh
exec bash "$(dirname "${BASH_SOURCE[0]}")/pictures.sh"
