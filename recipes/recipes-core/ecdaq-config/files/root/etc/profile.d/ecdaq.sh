# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Completion of ecdaq for who logs in; the image has no package bash-completion. Read by sh, too.
case $- in
*i*) [ -z "${BASH_VERSION:-}" ] || eval "$(ecdaq completion)" ;;
esac
