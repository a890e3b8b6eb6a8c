# SPDX-License-Identifier: MIT
# A source with its own debian/ folder, or one that the recipe makes with deb_debianize.
inherit dpkg-base
